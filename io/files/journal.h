// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A journal beneath HDF5: flushed data stay intact, whichever write is interrupted by a kill.
//
// HDF5 promises no order of its writes, so that a kill in the middle of a flush leaves a file that cannot be read. This
// file driver sits between the library and the file. Data beyond the end of the last flush are written at once, since
// nothing refers to them yet. All other data wait in memory for the next flush, which reserves space for new data (so a
// full disk is detected here), writes the waiting blocks to a journal beside the file, with a checksum, then to the
// file, and empties the journal. A kill before the journal is complete leaves the state of the last flush;
// replay_journal() repairs the file after a later kill. A new file is called `name.part` until its first flush: a file
// of its name is whole. (Write-ahead logging: Gray, Reuter, Transaction Processing, 1993, chapter 9.)
//
// A power failure can do no harm to a flush that was synced to the disk. A sync takes milliseconds, so it is done only
// when twenty times the duration of the last sync has passed since, and when the file is closed.
//
// The journal, in 64-bit numbers, little-endian: "CAROMJ01"; the CRC-32 of all that follows it; the length of the
// whole; the size of the file; then for each block its address, its length, and its bytes. An empty journal starts with
// 0. tools/carom_files.py reads it too. A file is locked (flock) while a driver has it open.

#include <hdf5.h>

#include <filesystem>
#include <functional>

namespace carom::hdf5 {

/// The identifier of the driver, for H5Pset_driver; it creates files and opens them to be changed.
hid_t journal_driver();

/// Writes what a complete journal beside the file holds to the file, and removes the journal. Throws
/// Error(Failure::file) if a process is writing the file, or the file cannot be changed.
void replay_journal(const std::filesystem::path& file);

/// Calls `read`, which opens the file, reads and closes it, until no flush happens between its beginning and its end:
/// it has then read the state of one flush, even if another process is writing the file. Takes no lock, except to
/// complete the flush of a process that was killed. Throws what `read` throws, or Error(Failure::file) if this takes
/// longer than ten seconds.
void read_between_flushes(const std::filesystem::path& file, const std::function<void()>& read);

}  // namespace carom::hdf5
