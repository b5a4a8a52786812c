// SPDX-License-Identifier: BSD-3-Clause
#include "parallel/mpi_communicator.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <utility>

namespace carom {

namespace {

constexpr std::size_t kMaxMessage = std::size_t{1} << 30;    // bytes of one message, at most
constexpr std::size_t kFirstMessage = std::size_t{1} << 15;  // bytes sent with the first message between neighbours
enum Tag : int { data, fold, step, first, known };

int bytes(std::size_t count) { return static_cast<int>(count); }

/// Starts to send or receive a message in as many pieces as necessary.
template <class Start>
void in_pieces(std::size_t size, Start&& start) {
  for (std::size_t at = 0; at < size; at += kMaxMessage) start(at, bytes(std::min(kMaxMessage, size - at)));
}

}  // namespace

MpiCommunicator::MpiCommunicator(MPI_Comm world, Watch& watch) : world_(world), watch_(watch) {
  MPI_Comm_rank(world_, &rank_);
  MPI_Comm_size(world_, &size_);
}

/// Recursive doubling: log2 P exchanges, each waited for with polls for failures. (A blocking MPI_Allreduce cannot be
/// left; MPI_Iallreduce takes three times as long.) The value of the lower rank comes first, so that all ranks get the
/// same bits.
void MpiCommunicator::combine(std::span<double> most, std::span<std::uint64_t> sums) {
  watch_.begin_call();
  begin_combine(most, sums);
  end_combine();
}

void MpiCommunicator::begin_combine(std::span<double> most, std::span<std::uint64_t> sums) {
  most_ = most;
  sums_ = sums;
  mine_.assign(sums.begin(), sums.end());
  for (const double value : most) mine_.push_back(std::bit_cast<std::uint64_t>(value));
  theirs_.resize(mine_.size());
  // Ranks beyond the largest power of two send their values to a rank below it, which sends the result back.
  const int rank = rank_, size = size_;
  int whole = 1;
  while (2 * whole <= size) whole *= 2;
  rounds_.clear();
  if (mine_.empty()) {
    // Nothing to combine.
  } else if (rank >= whole) {
    rounds_ = {{rank - whole, fold, true, false}, {rank - whole, fold, false, true}};
  } else {
    if (rank + whole < size) rounds_.push_back({rank + whole, fold, false, true});
    for (int bit = 1; bit < whole; bit *= 2) rounds_.push_back({rank ^ bit, step, true, true});
    if (rank + whole < size) rounds_.push_back({rank + whole, fold, true, false});
  }
  round_ = 0;
  begin_round();
}

void MpiCommunicator::begin_round() {
  if (round_ == rounds_.size()) return;
  const auto [partner, tag, sends, receives] = rounds_[round_];
  const int length = bytes(mine_.size() * sizeof(std::uint64_t));
  if (receives) MPI_Irecv(theirs_.data(), length, MPI_BYTE, partner, tag, world_, &combining_[0]);
  if (sends) MPI_Isend(mine_.data(), length, MPI_BYTE, partner, tag, world_, &combining_[1]);
}

void MpiCommunicator::end_combine() {
  const auto larger = [](std::uint64_t a, std::uint64_t b) {
    return std::bit_cast<std::uint64_t>(std::max(std::bit_cast<double>(a), std::bit_cast<double>(b)));
  };
  for (; round_ < rounds_.size(); ++round_, begin_round()) {
    watch_.wait(combining_);
    const auto [partner, tag, sends, receives] = rounds_[round_];
    if (!receives) continue;
    if (partner < rank_) mine_.swap(theirs_);
    if (round_ > 0 && !rounds_[round_ - 1].receives) continue;  // it has sent its values before: this is the result
    for (std::size_t k = 0; k < mine_.size(); ++k)
      mine_[k] = k < sums_.size() ? mine_[k] + theirs_[k] : larger(mine_[k], theirs_[k]);
  }
  for (std::size_t k = 0; k < sums_.size(); ++k) sums_[k] = mine_[k];
  for (std::size_t k = 0; k < most_.size(); ++k) most_[k] = std::bit_cast<double>(mine_[sums_.size() + k]);
}

void MpiCommunicator::start(std::vector<Bytes>& outgoing, std::span<const int> partners,
                            std::span<const std::size_t> sizes, std::span<double> most) {
  watch_.begin_call();
  departures_[0].messages.swap(departures_[1].messages);
  departures_[0].requests.swap(departures_[1].requests);
  std::vector<Bytes>& messages = departures_[0].messages;
  std::vector<MPI_Request>& requests = departures_[0].requests;
  if (!requests.empty()) watch_.wait(requests);
  requests.clear();
  messages.swap(outgoing);
  arriving_[0].swap(arriving_[1]);
  arriving_[0].resize(partners.size());
  for (std::size_t k = 0; k < partners.size(); ++k) {
    Bytes &in = arriving_[0][k], &out = messages[k];
    in.resize(sizes[k]);
    in_pieces(in.size(), [&](std::size_t at, int count) {
      MPI_Irecv(in.data() + at, count, MPI_BYTE, partners[k], known, world_,
                &receiving_.emplace_back(MPI_REQUEST_NULL));
    });
    in_pieces(out.size(), [&](std::size_t at, int count) {
      MPI_Isend(out.data() + at, count, MPI_BYTE, partners[k], known, world_, &requests.emplace_back(MPI_REQUEST_NULL));
    });
  }
  begin_combine(most, {});
}

const std::vector<Bytes>& MpiCommunicator::complete() {
  watch_.begin_call();
  if (!receiving_.empty()) watch_.wait(receiving_);
  receiving_.clear();
  end_combine();
  return arriving_[0];
}

std::vector<Bytes> MpiCommunicator::trade(const std::function<const Bytes&(std::size_t)>& outgoing) {
  watch_.begin_call();
  const auto p = static_cast<std::size_t>(size());
  leaving_.resize(p);
  coming_.resize(p);
  for (std::size_t r = 0; r < p; ++r) leaving_[r] = outgoing(r).size();
  MPI_Request sizes = MPI_REQUEST_NULL;
  MPI_Ialltoall(leaving_.data(), 1, MPI_UINT64_T, coming_.data(), 1, MPI_UINT64_T, world_, &sizes);
  watch_.wait({&sizes, 1});

  incoming_.assign(p, {});
  std::vector<MPI_Request> requests;
  const auto next = [&] { return &requests.emplace_back(MPI_REQUEST_NULL); };
  for (std::size_t r = 0; r < p; ++r) {
    const int other = static_cast<int>(r);
    if (other == rank()) continue;
    incoming_[r].resize(coming_[r]);
    in_pieces(coming_[r], [&](std::size_t at, int count) {
      MPI_Irecv(incoming_[r].data() + at, count, MPI_BYTE, other, data, world_, next());
    });
    in_pieces(leaving_[r], [&](std::size_t at, int count) {
      MPI_Isend(outgoing(r).data() + at, count, MPI_BYTE, other, data, world_, next());
    });
  }
  if (!requests.empty()) watch_.wait(requests);
  return std::move(incoming_);
}

std::vector<Bytes> MpiCommunicator::swap(std::vector<Bytes> outgoing) {
  outgoing_ = std::move(outgoing);
  auto incoming = trade([this](std::size_t r) -> const Bytes& { return outgoing_[r]; });
  const auto self = static_cast<std::size_t>(rank());
  incoming[self] = std::move(outgoing_[self]);
  outgoing_.clear();
  return incoming;
}

/// The first message to a neighbour has the length and as much of the data as fits; few need a second message.
std::vector<Bytes> MpiCommunicator::swap(std::vector<Bytes> outgoing, std::span<const int> partners) {
  watch_.begin_call();
  outgoing_ = std::move(outgoing);
  incoming_.resize(partners.size());
  first_in_.resize(partners.size());
  first_out_.resize(partners.size());
  std::vector<MPI_Request> requests;
  requests.reserve(2 * partners.size());
  const auto next = [&] { return &requests.emplace_back(MPI_REQUEST_NULL); };
  for (std::size_t k = 0; k < partners.size(); ++k) {
    const Bytes& all = outgoing_[k];
    Bytes &in = first_in_[k], &out = first_out_[k];
    out.clear();
    put(out, std::uint64_t{all.size()});
    out.insert(out.end(), all.begin(), all.begin() + static_cast<std::ptrdiff_t>(std::min(all.size(), kFirstMessage)));
    in.resize(sizeof(std::uint64_t) + kFirstMessage);
    MPI_Irecv(in.data(), bytes(in.size()), MPI_BYTE, partners[k], first, world_, next());
    MPI_Isend(out.data(), bytes(out.size()), MPI_BYTE, partners[k], first, world_, next());
  }
  watch_.wait(requests);
  requests.clear();
  for (std::size_t k = 0; k < partners.size(); ++k) {
    Reader reader(first_in_[k]);
    Bytes &in = incoming_[k], &out = outgoing_[k];
    in.resize(reader.get<std::uint64_t>());
    if (!in.empty()) std::memcpy(in.data(), reader.skip(0), std::min(in.size(), kFirstMessage));
    if (in.size() > kFirstMessage)
      in_pieces(in.size() - kFirstMessage, [&](std::size_t at, int count) {
        MPI_Irecv(in.data() + kFirstMessage + at, count, MPI_BYTE, partners[k], data, world_, next());
      });
    if (out.size() > kFirstMessage)
      in_pieces(out.size() - kFirstMessage, [&](std::size_t at, int count) {
        MPI_Isend(out.data() + kFirstMessage + at, count, MPI_BYTE, partners[k], data, world_, next());
      });
  }
  if (!requests.empty()) watch_.wait(requests);
  return std::exchange(incoming_, std::move(outgoing_));  // the next messages reuse the memory
}

std::vector<Bytes> MpiCommunicator::gather(const Bytes& mine) {
  auto incoming = trade([&mine](std::size_t) -> const Bytes& { return mine; });
  incoming[static_cast<std::size_t>(rank())] = mine;
  return incoming;
}

}  // namespace carom
