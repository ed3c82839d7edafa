#pragma once
// A Markov decision process and two policies small enough for tables, and the paper's values on
// them as solutions of linear systems. Source: spec 9.

#include <array>
#include <cstdint>

#include "base/rng.h"
#include "base/types.h"

namespace o2v::exact {

constexpr int S = 3, K = 2, A = 2;
constexpr double kGamma = 0.9;

/// A state and an option are one row: x = (s, o') before o is chosen, y = (s, o) after it.
constexpr int kRows = S * K;
constexpr int Row(int s, int o) { return s * K + o; }
constexpr int StateOf(int row) { return row / K; }
constexpr int OptionOf(int row) { return row % K; }

/// A task and both policies: all that a return depends on.
struct Process {
  std::array<MatD, A> p;  // p[a](s, s+) = p(s+|s,a); the paper's letter P is the option policy's
  MatD r;                 // (S, A), r(s,a)
  MatD P;                 // (S K, K), P(o|s,o') at (Row(s,o'), o)
  MatD pi_a;              // (S K, A), pi_a(a|s,o) at (Row(s,o), a)
};

/// A random process: p Dirichlet(1), r normal, P and pi_a softmax of normal tables.
struct Instance {
  explicit Instance(std::uint64_t seed);

  std::uint64_t seed;
  MatD theta_o, theta_a;  // process.P = Softmax(theta_o), process.pi_a = Softmax(theta_a)
  Process process;
  VecD d_0;  // (S K), law of (s_0, o_{-1}): Dirichlet(1)
};

/// Softmax of every row.
MatD Softmax(const MatD& theta);
/// (rows, cols) probabilities, each row Dirichlet(1).
MatD RandomLaws(Index rows, Index cols, Rng& rng);
/// (rows, cols) standard normal numbers.
MatD RandomNormals(Index rows, Index cols, Rng& rng);

/// E[f(x, o, a, s+) | x] for all x = (s, o'): the sum over o, a and s+ of
/// P(o|s,o') pi_a(a|s,o) p(s+|s,a) f(x, o, a, s+). Returns (S K).
template <typename F>
VecD Expect(const Process& process, F f) {
  VecD mean = VecD::Zero(kRows);
  for (int x = 0; x < kRows; ++x) {
    const int s = StateOf(x);
    for (int o = 0; o < K; ++o) {
      for (int a = 0; a < A; ++a) {
        for (int s_next = 0; s_next < S; ++s_next) {
          mean(x) += process.P(x, o) * process.pi_a(Row(s, o), a) * process.p[a](s, s_next) *
                     f(x, o, a, s_next);
        }
      }
    }
  }
  return mean;
}

/// Exact values.
struct Values {
  MatD T;      // (S K, S K), T[(s,o') -> (s+,o)], the chain of x_t = (s_t, o_{t-1})
  VecD r_bar;  // (S K), expected reward at x
  VecD V_bar;  // (S K), V_bar(s,o')
  VecD Q_O;    // (S K), Q_O(s,o)
  MatD Q_A;    // (S K, A), Q_A(s,o,a)
};
/// Source: spec 9.1; the paper's Eq. (7) with G_{t+1} where it prints G_t.
Values Solve(const Process& process);

/// M(s,o') = E[G^2 | s, o'] (S K). Source: spec 9.3.
VecD SecondMoment(const Process& process, const Values& values);
/// Var(G | s, o') (S K), without M: from the errors of V_bar along the way. Source: ours.
VecD VarianceOfReturn(const Process& process, const Values& values);

/// U[(s,o) -> (s+,o+)] (S K, S K), the chain of y_t = (s_t, o_t). Source: spec 9.5.
MatD ActionChain(const Process& process);
/// sum_{n >= 0} gamma^n T^n: discounted visits of every row from every row.
MatD Visits(const MatD& T);
/// d with d T = d and sum 1.
VecD Stationary(const MatD& T);

/// b(o'|s) = d(s,o') / sum_{o'} d(s,o'), at Row(s,o').
VecD GivenState(const VecD& d);
/// E[f(s,o') | s] = sum_{o'} b(o'|s) f(s,o'). Returns (S).
VecD MeanGivenState(const VecD& b, const VecD& f);
/// Var(f(s,o') | s). Returns (S).
VecD VarianceGivenState(const VecD& b, const VecD& f);

/// g(x, j) = sum_o dP(o|x)/dtheta_o(x,j) Q_O(s,o), the option policy's term. (S K, K). Other rows
/// of theta_o do not touch row x.
MatD OptionTerm(const Process& process, const Values& values);
/// h(y, j) = sum_a dpi_a(a|y)/dtheta_a(y,j) Q_A(s,o,a), the action policy's term. (S K, A).
MatD ActionTerm(const Process& process, const Values& values);

/// An index by the probabilities in a row of a table.
int Draw(const MatD& table, int row, Rng& rng);

/// Draws one way from x on until gamma^n < 1e-6, where what is left out is less than 1/100 of a
/// standard error of 200000 returns; calls visit(gamma^n, x_n, o_n, a_n).
template <typename Visit>
void Rollout(const Process& process, int x, Rng& rng, Visit visit) {
  for (double discount = 1; discount >= 1e-6; discount *= kGamma) {
    const int s = StateOf(x);
    const int o = Draw(process.P, x, rng);
    const int a = Draw(process.pi_a, Row(s, o), rng);
    visit(discount, x, o, a);
    x = Row(Draw(process.p[a], s, rng), o);
  }
}

}  // namespace o2v::exact
