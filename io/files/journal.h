// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A journal beneath HDF5: what has been flushed stays whole, at whatever write the process is killed.
//
// HDF5 promises no order of its writes, so that a kill in the middle of a flush leaves a file that cannot be read. This
// file driver stands between the library and the file. What comes behind the end that the last flush left is written
// at once: nothing refers to it yet. All else waits in memory for the next flush, which sets aside room for what is
// new (so a full disk is met here), writes what waits to a journal beside the file, with a checksum, then to the file,
// and empties the journal. A kill before the journal is complete leaves the state of the last flush, a later one is
// made good by replay_journal(). A new file is called `name.part` until its first flush: a file of its name is whole.
// (Write-ahead logging: Gray, Reuter, Transaction Processing, 1993, chapter 9.)
//
// A power failure can do no harm to a flush that was synced to the disk. To sync takes milliseconds: so it is done
// only when twenty times as long as the last one took has gone by since, and when the file is closed.
//
// The journal, in 64-bit numbers, little-endian: "CAROMJ01"; the CRC-32 of all behind it; the length of the whole; the
// size of the file; then for each block its address, its length, and its bytes. An empty one starts with 0.
// tools/carom_files.py reads it too. A file is locked (flock) while a driver has it open.

#include <hdf5.h>

#include <filesystem>
#include <functional>

namespace carom::hdf5 {

/// The identifier of the driver, for H5Pset_driver; it creates files and opens them to be changed.
hid_t journal_driver();

/// Writes what a complete journal beside the file holds to the file, and removes the journal. Throws
/// Error(Failure::file) where a process is writing the file at this time, or the file cannot be changed.
void replay_journal(const std::filesystem::path& file);

/// Calls `read`, which opens the file, reads and closes it, until no flush has come between its begin and its end: what
/// it then has read is the state of one flush, though another process is writing the file. Takes no lock, except to
/// complete the flush of a process that was killed. Throws what `read` throws, or Error(Failure::file) where that takes
/// longer than ten seconds.
void read_between_flushes(const std::filesystem::path& file, const std::function<void()>& read);

}  // namespace carom::hdf5
