#include "crackle/factor/cholmod_factor.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <numeric>
#include <stdexcept>
#include <string>

#include "crackle/base/error.hpp"
#include "crackle/base/memory.hpp"
#include "crackle/factor/null_pivot.hpp"

namespace crackle {

namespace {

/// A number and its row, of the factor that is kept; while it is made there is more.
constexpr double kBytesAnEntry = sizeof(double) + sizeof(int);

constexpr std::size_t kMostRank = 64;
/// Unknowns of a subgraph that is not dissected further; 50 to 200 differ by less than 1 % in fill.
constexpr int kSmallSubgraph = 100;

/// CHOLMOD's view of K: the upper triangle by columns is the lower one by rows, so the arrays serve as they
/// are.
cholmod_sparse as_cholmod(const SymmetricRows& K, const double* value) {
  cholmod_sparse view{};
  view.nrow = view.ncol = static_cast<std::size_t>(K.n);
  view.nzmax = static_cast<std::size_t>(K.start[K.n]);
  view.p = const_cast<int*>(K.start);   // NOLINT: CHOLMOD reads only
  view.i = const_cast<int*>(K.column);  // NOLINT
  view.x = const_cast<double*>(value);  // NOLINT
  view.stype = 1;
  view.itype = CHOLMOD_INT;
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  view.sorted = view.packed = 1;
  return view;
}

/// Unknowns in elimination order: nested dissection of all but the last block, then that.
///
/// CHOLMOD's dissection with METIS's separators, down to small subgraphs that a constrained minimum degree
/// orders: a fifth fewer entries than METIS_NodeND leaves, measured from L = 16 to 256.
std::vector<int> dissect(const SymmetricRows& K, int block_size, cholmod_common& common) {
  const int inner = K.n - block_size;
  std::vector<int> order(static_cast<std::size_t>(K.n));
  std::iota(order.begin(), order.end(), 0);
  std::vector<int> start{0};
  std::vector<int> column;
  for (int row = 0; row < inner; ++row) {
    std::copy_if(K.column + K.start[row], K.column + K.start[row + 1], std::back_inserter(column),
                 [inner](int c) { return c < inner; });
    start.push_back(static_cast<int>(column.size()));
  }
  const SymmetricRows pattern{inner, start.data(), column.data(), nullptr};
  cholmod_sparse view = as_cholmod(pattern, nullptr);
  view.xtype = CHOLMOD_PATTERN;
  std::vector<int> parent(order.size());
  std::vector<int> member(order.size());
  if (inner > 0 &&
      cholmod_nested_dissection(&view, nullptr, 0, order.data(), parent.data(), member.data(), &common) < 0) {
    throw std::runtime_error("METIS could not order the network: " + explain(std::bad_alloc()) + "; " +
                             kLessMemory);
  }
  return order;
}

double diagonal(const SymmetricRows& K, int row) {
  const int* const begin = K.column + K.start[row];
  const int* const end = K.column + K.start[row + 1];
  return K.value[std::lower_bound(begin, end, row) - K.column];
}

const int* starts(const cholmod_factor* factor) {
  return static_cast<const int*>(factor->p);
}
const int* rows(const cholmod_factor* factor) {
  return static_cast<const int*>(factor->i);
}
double* values(const cholmod_factor* factor) {
  return static_cast<double*>(factor->x);
}
double pivot(const cholmod_factor* factor, int column) {
  return values(factor)[starts(factor)[column]];
}

/// -1 at a root.
int parent(const cholmod_factor* factor, int column) {
  const bool leaf_only = static_cast<const int*>(factor->nz)[column] <= 1;
  return leaf_only ? -1 : rows(factor)[starts(factor)[column] + 1];
}

}  // namespace

CholmodFactor::CholmodFactor(const SymmetricRows& K, int block_size) {
  cholmod_start(&common_);
  common_.print = 0;
  common_.nmethods = 1;
  common_.method[0].ordering = CHOLMOD_GIVEN;
  common_.method[0].nd_small = kSmallSubgraph;
  common_.postorder = 1;
  common_.final_super = 0;
  common_.final_ll = 0;
  common_.final_asis = 0;
  common_.final_pack = 1;
  common_.final_monotonic = 1;
  common_.final_resymbol = 1;
  try {
    analyse(K, block_size);
  } catch (...) {
    cholmod_finish(&common_);
    throw;
  }
}

CholmodFactor::~CholmodFactor() {
  for (cholmod_dense** dense : {&load_, &x_, &y_, &e_}) cholmod_free_dense(dense, &common_);
  cholmod_free_sparse(&change_, &common_);
  cholmod_free_factor(&factor_, &common_);
  cholmod_free_factor(&analysis_, &common_);
  cholmod_finish(&common_);
}

void CholmodFactor::analyse(const SymmetricRows& K, int block_size) {
  order_ = dissect(K, block_size, common_);
  cholmod_sparse view = as_cholmod(K, K.value);
  analysis_ = cholmod_analyze_p(&view, order_.data(), nullptr, 0, &common_);
  const auto n = static_cast<std::size_t>(K.n);
  change_ = cholmod_allocate_sparse(n, kMostRank, 4 * kMostRank, 1, 1, 0, CHOLMOD_REAL, &common_);
  load_ = cholmod_zeros(n, 1, CHOLMOD_REAL, &common_);
  if (analysis_ == nullptr || change_ == nullptr || load_ == nullptr) {
    throw_no_memory();
  }
  demand_memory("CHOLMOD's factor of " + std::to_string(K.n) + " unknowns", kBytesAnEntry * common_.lnz);
  const auto* permutation = static_cast<const int*>(analysis_->Perm);
  order_.assign(permutation, permutation + n);
  position_.resize(n);
  for (int i = 0; i < K.n; ++i) position_[order_[i]] = i;
  on_path_.assign(n, 0);
}

/// Supernodal LL^T first, then converted to simplicial LDL^T: three times as fast as LDL^T at once.
void CholmodFactor::factor_afresh(const SymmetricRows& K) {
  cholmod_sparse view = as_cholmod(K, K.value);
  cholmod_free_factor(&factor_, &common_);
  factor_ = cholmod_copy_factor(analysis_, &common_);
  if (factor_ == nullptr || cholmod_factorize(&view, factor_, &common_) == 0) {
    throw_no_memory();
  }
  // it says yes when the conversion finds no memory, and leaves a factor without numbers
  if (common_.status < CHOLMOD_OK || factor_->xtype == CHOLMOD_PATTERN || factor_->is_super != 0)
    throw_no_memory();
  bytes_ = static_cast<std::int64_t>(factor_->nzmax * (sizeof(double) + sizeof(int)) +
                                     kept_.size() * sizeof(double));
}

void CholmodFactor::throw_no_memory() const {
  throw std::runtime_error("CHOLMOD found no memory, for a factor of " +
                           mebibytes(kBytesAnEntry * common_.lnz) + ": " + explain(std::bad_alloc()) + "; " +
                           kLessMemory);
}

bool CholmodFactor::factor(const SymmetricRows& K) {
  pinned_.clear();
  factor_afresh(K);
  const bool definite = factor_->minor == factor_->n;
  if (definite && pivots_hold(K)) return true;
  return factor_pinned(K);
}

bool CholmodFactor::pivots_hold(const SymmetricRows& K) {
  const auto last = static_cast<std::size_t>(K.n) - 1;
  pivot_share_.resize(last);
  for (std::size_t column = 0; column < last; ++column) {
    pivot_share_[column] = pivot(factor_, static_cast<int>(column)) / diagonal(K, order_[column]);
  }
  smallest_pivot_ = last > 0 ? *std::ranges::min_element(pivot_share_) : 1;
  const bool hold = std::ranges::all_of(pivot_share_, [](double share) { return share > kNullPivot; });
  return hold && pivot(factor_, K.n - 1) > 0;
}

std::vector<int> CholmodFactor::small_pivots(double least) const {
  std::vector<int> small = pinned_;
  for (std::size_t column = 0; column < pivot_share_.size(); ++column) {
    const int unknown = order_[column];
    const bool is_small = !(pivot_share_[column] > least);
    if (is_small && std::ranges::find(pinned_, unknown) == pinned_.end()) small.push_back(unknown);
  }
  return small;
}

bool CholmodFactor::factor_pinned(const SymmetricRows& K) {
  pinned_ = find_null_pivots(K);
  if (pinned_.empty()) return false;
  pinned_value_.assign(K.value, K.value + K.start[K.n]);
  for (const int row : pinned_) {
    const int* const begin = K.column + K.start[row];
    double& entry = pinned_value_[std::lower_bound(begin, K.column + K.start[row + 1], row) - K.column];
    entry += entry > 0 ? entry : 1;  // 0: no bond is left there
  }
  const SymmetricRows pinned{K.n, K.start, K.column, pinned_value_.data()};
  factor_afresh(pinned);
  return factor_->minor == factor_->n && pivots_hold(pinned);
}

/// One simplicial LDL^T of K scaled to a unit diagonal, in which a pivot that is not above kNullPivot is
/// replaced by that bound: the rounding that its column holds then stays rounding in what follows.
std::vector<int> CholmodFactor::find_null_pivots(const SymmetricRows& K) {
  std::vector<double> scale(static_cast<std::size_t>(K.n));
  for (int row = 0; row < K.n; ++row) {
    const double entry = diagonal(K, row);
    scale[row] = entry > 0 ? 1 / std::sqrt(entry) : 1;
  }
  std::vector<double> scaled(K.value, K.value + K.start[K.n]);
  for (int row = 0; row < K.n; ++row) {
    for (int i = K.start[row]; i < K.start[row + 1]; ++i) scaled[i] *= scale[row] * scale[K.column[i]];
  }
  cholmod_sparse view = as_cholmod(K, scaled.data());
  const int strategy = common_.supernodal;
  common_.supernodal = CHOLMOD_SIMPLICIAL;
  common_.dbound = kNullPivot;
  common_.postorder = 0;
  std::vector<int> order = order_;
  cholmod_factor* probe = cholmod_analyze_p(&view, order.data(), nullptr, 0, &common_);
  if (probe != nullptr) cholmod_factorize(&view, probe, &common_);
  const bool made = probe != nullptr && common_.status >= CHOLMOD_OK && probe->xtype != CHOLMOD_PATTERN;
  common_.supernodal = strategy;
  common_.dbound = 0;
  common_.postorder = 1;
  std::vector<int> found;
  for (int column = 0; made && column < K.n - 1; ++column) {
    if (!(std::abs(pivot(probe, column)) > 2 * kNullPivot)) found.push_back(order_[column]);
  }
  cholmod_free_factor(&probe, &common_);
  if (!made) throw_no_memory();
  return found;
}

void CholmodFactor::fill_change(std::span<const RankOne> w) {
  auto* start = static_cast<int*>(change_->p);
  auto* row = static_cast<int*>(change_->i);
  auto* value = static_cast<double*>(change_->x);
  int filled = 0;
  change_->ncol = w.size();
  for (std::size_t column = 0; column < w.size(); ++column) {
    start[column] = filled;
    for (int i = 0; i < w[column].size; ++i, ++filled) {
      const int place = position_[w[column].row[i]];
      int at = filled;  // rows ascend within a column
      for (; at > start[column] && row[at - 1] > place; --at) {
        row[at] = row[at - 1];
        value[at] = value[at - 1];
      }
      row[at] = place;
      value[at] = w[column].value[i];
    }
  }
  start[w.size()] = filled;
}

/// The columns from each w's first row up to the roots of the elimination tree, each once.
void CholmodFactor::collect_path(std::span<const RankOne> w) {
  assert(std::ranges::count(on_path_, 0) == std::ssize(on_path_));
  path_.clear();
  path_pivot_.clear();
  const auto* start = static_cast<const int*>(change_->p);
  for (std::size_t k = 0; k < w.size(); ++k) {
    int column = start[k] < start[k + 1] ? static_cast<const int*>(change_->i)[start[k]] : -1;
    for (; column >= 0 && on_path_[column] == 0; column = parent(factor_, column)) {
      on_path_[column] = 1;
      path_.push_back(column);
      path_pivot_.push_back(pivot(factor_, column));
    }
  }
  for (const int column : path_) on_path_[column] = 0;
}

double CholmodFactor::downdate(std::span<const RankOne> w) {
  double slack = 1;
  for (; w.size() > kMostRank; w = w.subspan(kMostRank)) slack *= downdate(w.first(kMostRank));
  fill_change(w);
  collect_path(w);
  if (cholmod_updown(0, change_, factor_, &common_) == 0) throw_no_memory();
  for (std::size_t i = 0; i < path_.size(); ++i) slack *= pivot(factor_, path_[i]) / path_pivot_[i];
  return std::isnan(slack) ? 0 : slack;
}

void CholmodFactor::solve(std::span<const double> b, std::span<double> x, bool both_sweeps) {
  const int last = order_.back();
  const auto is_zero = [](double entry) { return entry == 0; };
  const bool plate_only = !both_sweeps && std::all_of(b.begin(), b.begin() + last, is_zero) &&
                          std::all_of(b.begin() + last + 1, b.end(), is_zero);
  run_solve(plate_only ? CHOLMOD_DLt : CHOLMOD_LDLt, b, x);
}

void CholmodFactor::back_substitute(std::span<double> x) {
  run_solve(CHOLMOD_Lt, x, x);
}

void CholmodFactor::run_solve(int system, std::span<const double> b, std::span<double> x) {
  assert(b.size() == order_.size() && x.size() == order_.size());
  auto* load = static_cast<double*>(load_->x);
  const std::size_t n = b.size();
  for (std::size_t i = 0; i < n; ++i) load[position_[i]] = b[i];
  if (cholmod_solve2(system, factor_, load_, nullptr, &x_, nullptr, &y_, &e_, &common_) == 0)
    throw_no_memory();
  const auto* solution = static_cast<const double*>(x_->x);
  for (std::size_t i = 0; i < n; ++i) x[i] = solution[position_[i]];
}

void CholmodFactor::keep() {
  kept_.assign(values(factor_), values(factor_) + factor_->nzmax);
  bytes_ = static_cast<std::int64_t>(factor_->nzmax * (2 * sizeof(double) + sizeof(int)));
}

bool CholmodFactor::restore() {
  if (factor_ == nullptr || kept_.size() != factor_->nzmax) return false;
  std::ranges::copy(kept_, values(factor_));
  return true;
}

double CholmodFactor::last_pivot() const {
  return pivot(factor_, static_cast<int>(factor_->n) - 1);
}

std::int64_t CholmodFactor::entries() const {
  const auto* count = static_cast<const int*>(factor_->nz);
  std::int64_t sum = 0;
  for (std::size_t column = 0; column < factor_->n; ++column) sum += count[column];
  return sum;
}

}  // namespace crackle
