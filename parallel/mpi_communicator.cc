// SPDX-License-Identifier: BSD-3-Clause
#include "parallel/mpi_communicator.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace carom {

namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 30;  // bytes of one message, at most
constexpr std::size_t kFirst = std::size_t{1} << 15;      // bytes that go with the first message among neighbours
enum Tag : int { data, fold, step, first };

int bytes(std::size_t count) { return static_cast<int>(count); }

/// Starts to send or receive a message in as many pieces as it takes.
template <class Start>
void in_pieces(std::size_t size, Start&& start) {
  for (std::size_t at = 0; at < size; at += kMostBytes) start(at, bytes(std::min(kMostBytes, size - at)));
}

}  // namespace

/// By recursive doubling: log2 P messages, each of which is waited for; meanwhile failures are looked for.
/// (MPI_Allreduce cannot be left; MPI_Iallreduce takes thrice as long.) The value of the lower rank comes first, so
/// that all get the same bits.
void MpiCommunicator::combine(std::span<double> most, std::span<std::uint64_t> sums) {
  ranks_.watch().begin_call();
  mine_.assign(sums.begin(), sums.end());
  for (const double value : most) mine_.push_back(std::bit_cast<std::uint64_t>(value));
  theirs_.resize(mine_.size());
  const int rank = ranks_.rank(), size = ranks_.size(), length = bytes(mine_.size() * sizeof(std::uint64_t));
  const auto swap_with = [&](int partner, Tag tag, bool sends, bool receives) {
    std::array<MPI_Request, 2> requests = {MPI_REQUEST_NULL, MPI_REQUEST_NULL};
    if (receives) MPI_Irecv(theirs_.data(), length, MPI_BYTE, partner, tag, ranks_.handle(), &requests[0]);
    if (sends) MPI_Isend(mine_.data(), length, MPI_BYTE, partner, tag, ranks_.handle(), &requests[1]);
    ranks_.watch().wait(requests);
  };
  const auto larger = [](std::uint64_t a, std::uint64_t b) {
    return std::bit_cast<std::uint64_t>(std::max(std::bit_cast<double>(a), std::bit_cast<double>(b)));
  };
  const auto take_in = [&](bool mine_first) {
    if (!mine_first) mine_.swap(theirs_);
    for (std::size_t k = 0; k < mine_.size(); ++k)
      mine_[k] = k < sums.size() ? mine_[k] + theirs_[k] : larger(mine_[k], theirs_[k]);
  };
  // Ranks beyond the largest power of two give their values to one below, and get the result from it.
  int whole = 1;
  while (2 * whole <= size) whole *= 2;
  if (rank >= whole) {
    swap_with(rank - whole, fold, true, false);
    swap_with(rank - whole, fold, false, true);
    mine_.swap(theirs_);
  } else {
    if (rank + whole < size) {
      swap_with(rank + whole, fold, false, true);
      take_in(true);
    }
    for (int bit = 1; bit < whole; bit *= 2) {
      swap_with(rank ^ bit, step, true, true);
      take_in((rank & bit) == 0);
    }
    if (rank + whole < size) swap_with(rank + whole, fold, true, false);
  }
  for (std::size_t k = 0; k < sums.size(); ++k) sums[k] = mine_[k];
  for (std::size_t k = 0; k < most.size(); ++k) most[k] = std::bit_cast<double>(mine_[sums.size() + k]);
}

std::vector<Bytes> MpiCommunicator::trade(const std::function<const Bytes&(std::size_t)>& outgoing) {
  ranks_.watch().begin_call();
  const auto p = static_cast<std::size_t>(size());
  leaving_.resize(p);
  coming_.resize(p);
  for (std::size_t r = 0; r < p; ++r) leaving_[r] = outgoing(r).size();
  MPI_Request sizes = MPI_REQUEST_NULL;
  MPI_Ialltoall(leaving_.data(), 1, MPI_UINT64_T, coming_.data(), 1, MPI_UINT64_T, ranks_.handle(), &sizes);
  ranks_.watch().wait({&sizes, 1});

  incoming_.assign(p, {});
  std::vector<MPI_Request> requests;
  const auto next = [&] { return &requests.emplace_back(MPI_REQUEST_NULL); };
  for (std::size_t r = 0; r < p; ++r) {
    const int other = static_cast<int>(r);
    if (other == rank()) continue;
    incoming_[r].resize(coming_[r]);
    in_pieces(coming_[r], [&](std::size_t at, int count) {
      MPI_Irecv(incoming_[r].data() + at, count, MPI_BYTE, other, data, ranks_.handle(), next());
    });
    in_pieces(leaving_[r], [&](std::size_t at, int count) {
      MPI_Isend(outgoing(r).data() + at, count, MPI_BYTE, other, data, ranks_.handle(), next());
    });
  }
  if (!requests.empty()) ranks_.watch().wait(requests);
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

/// The first message to a neighbour has the length, and as much of the data as fits; few need a second one.
std::vector<Bytes> MpiCommunicator::swap(std::vector<Bytes> outgoing, std::span<const int> partners) {
  ranks_.watch().begin_call();
  outgoing_ = std::move(outgoing);
  incoming_.assign(partners.size(), {});
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
    out.insert(out.end(), all.begin(), all.begin() + static_cast<std::ptrdiff_t>(std::min(all.size(), kFirst)));
    in.resize(sizeof(std::uint64_t) + kFirst);
    MPI_Irecv(in.data(), bytes(in.size()), MPI_BYTE, partners[k], first, ranks_.handle(), next());
    MPI_Isend(out.data(), bytes(out.size()), MPI_BYTE, partners[k], first, ranks_.handle(), next());
  }
  ranks_.watch().wait(requests);
  requests.clear();
  for (std::size_t k = 0; k < partners.size(); ++k) {
    Reader reader(first_in_[k]);
    Bytes &in = incoming_[k], &out = outgoing_[k];
    in.resize(reader.get<std::uint64_t>());
    if (!in.empty()) std::memcpy(in.data(), reader.skip(0), std::min(in.size(), kFirst));
    if (in.size() > kFirst)
      in_pieces(in.size() - kFirst, [&](std::size_t at, int count) {
        MPI_Irecv(in.data() + kFirst + at, count, MPI_BYTE, partners[k], data, ranks_.handle(), next());
      });
    if (out.size() > kFirst)
      in_pieces(out.size() - kFirst, [&](std::size_t at, int count) {
        MPI_Isend(out.data() + kFirst + at, count, MPI_BYTE, partners[k], data, ranks_.handle(), next());
      });
  }
  if (!requests.empty()) ranks_.watch().wait(requests);
  outgoing_.clear();
  return std::move(incoming_);
}

std::vector<Bytes> MpiCommunicator::gather(const Bytes& mine) {
  auto incoming = trade([&mine](std::size_t) -> const Bytes& { return mine; });
  incoming[static_cast<std::size_t>(rank())] = mine;
  return incoming;
}

}  // namespace carom
