#include "exact/tabular.h"

#include <Eigen/LU>
#include <cmath>

namespace o2v::exact {

Instance::Instance(std::uint64_t seed) : seed(seed) {
  Rng rng(seed, "tabular");
  for (MatD& p : process.p) p = RandomLaws(S, S, rng);
  process.r = RandomNormals(S, A, rng);
  theta_o = RandomNormals(kRows, K, rng);
  theta_a = RandomNormals(kRows, A, rng);
  process.P = Softmax(theta_o);
  process.pi_a = Softmax(theta_a);
  d_0 = RandomLaws(1, kRows, rng).transpose();
}

MatD Softmax(const MatD& theta) {
  const MatD e = theta.array().exp();
  return e.array().colwise() / e.rowwise().sum().array();
}

MatD RandomLaws(Index rows, Index cols, Rng& rng) {
  // Exponential numbers over their sum are Dirichlet(1).
  const MatD e = MatD::NullaryExpr(rows, cols, [&] { return -std::log(1 - rng.Uniform()); });
  return e.array().colwise() / e.rowwise().sum().array();
}

MatD RandomNormals(Index rows, Index cols, Rng& rng) {
  return MatD::NullaryExpr(rows, cols, [&] { return rng.Normal(); });
}

Values Solve(const Process& process) {
  const MatD& r = process.r;
  Values v;
  // r_bar(s,o') = sum_o P(o|s,o') sum_a pi_a(a|s,o) r(s,a)
  v.r_bar = Expect(process, [&](int x, int, int a, int) { return r(StateOf(x), a); });
  // T[(s,o') -> (s+,o)] = P(o|s,o') sum_a pi_a(a|s,o) p(s+|s,a)
  v.T.resize(kRows, kRows);
  for (int x_next = 0; x_next < kRows; ++x_next) {
    v.T.col(x_next) = Expect(
        process, [&](int, int o, int, int s_next) { return Row(s_next, o) == x_next ? 1.0 : 0.0; });
  }
  // V_bar = r_bar + gamma T V_bar
  v.V_bar = (MatD::Identity(kRows, kRows) - kGamma * v.T).lu().solve(v.r_bar);

  v.Q_A.resize(kRows, A);
  v.Q_O.resize(kRows);
  for (int s = 0; s < S; ++s) {
    for (int o = 0; o < K; ++o) {
      const int y = Row(s, o);
      for (int a = 0; a < A; ++a) {
        // Q_A(s,o,a) = r(s,a) + gamma sum_{s+} p(s+|s,a) V_bar(s+,o)
        v.Q_A(y, a) = r(s, a);
        for (int s_next = 0; s_next < S; ++s_next) {
          v.Q_A(y, a) += kGamma * process.p[a](s, s_next) * v.V_bar(Row(s_next, o));
        }
      }
      // Q_O(s,o) = sum_a pi_a(a|s,o) Q_A(s,o,a)
      v.Q_O(y) = process.pi_a.row(y).dot(v.Q_A.row(y));
    }
  }
  return v;
}

VecD SecondMoment(const Process& process, const Values& v) {
  const MatD& r = process.r;
  // G^2 = r^2 + 2 gamma r G+ + gamma^2 G+^2, hence M = r2 + 2 gamma c + gamma^2 T M with
  // r2(x) = E[r^2 | x], c(x) = E[r V_bar(x+) | x]
  const VecD r2 =
      Expect(process, [&](int x, int, int a, int) { return std::pow(r(StateOf(x), a), 2); });
  const VecD c = Expect(process, [&](int x, int o, int a, int s_next) {
    return r(StateOf(x), a) * v.V_bar(Row(s_next, o));
  });
  return (MatD::Identity(kRows, kRows) - kGamma * kGamma * v.T).lu().solve(r2 + 2 * kGamma * c);
}

VecD VarianceOfReturn(const Process& process, const Values& v) {
  // G - V_bar(x_0) = sum_n gamma^n delta_n, delta_n = r_n + gamma V_bar(x_{n+1}) - V_bar(x_n); the
  // errors are uncorrelated, hence Var(G|x_0) = sum_n gamma^{2n} E[delta_n^2 | x_0].
  const VecD delta2 = Expect(process, [&](int x, int o, int a, int s_next) {
    return std::pow(process.r(StateOf(x), a) + kGamma * v.V_bar(Row(s_next, o)) - v.V_bar(x), 2);
  });
  return (MatD::Identity(kRows, kRows) - kGamma * kGamma * v.T).lu().solve(delta2);
}

MatD ActionChain(const Process& process) {
  const auto& [p, r, P, pi_a] = process;
  MatD U = MatD::Zero(kRows, kRows);
  for (int y = 0; y < kRows; ++y) {
    for (int y_next = 0; y_next < kRows; ++y_next) {
      for (int a = 0; a < A; ++a) {
        // U[(s,o) -> (s+,o+)] = sum_a pi_a(a|s,o) p(s+|s,a) P(o+|s+,o)
        U(y, y_next) += pi_a(y, a) * p[a](StateOf(y), StateOf(y_next)) *
                        P(Row(StateOf(y_next), OptionOf(y)), OptionOf(y_next));
      }
    }
  }
  return U;
}

MatD Visits(const MatD& T) { return (MatD::Identity(kRows, kRows) - kGamma * T).inverse(); }

VecD Stationary(const MatD& T) {
  // (I - T^T) d = 0 has one equation too many; sum d = 1 takes its place.
  MatD equations = MatD::Identity(kRows, kRows) - T.transpose();
  equations.row(0).setOnes();
  return equations.lu().solve(VecD::Unit(kRows, 0));
}

VecD GivenState(const VecD& d) {
  VecD b(kRows);
  for (int s = 0; s < S; ++s) {
    b.segment(Row(s, 0), K) = d.segment(Row(s, 0), K) / d.segment(Row(s, 0), K).sum();
  }
  return b;
}

VecD MeanGivenState(const VecD& b, const VecD& f) {
  VecD mean(S);
  for (int s = 0; s < S; ++s) mean(s) = b.segment(Row(s, 0), K).dot(f.segment(Row(s, 0), K));
  return mean;
}

VecD VarianceGivenState(const VecD& b, const VecD& f) {
  const VecD mean = MeanGivenState(b, f);
  VecD square(kRows);
  for (int x = 0; x < kRows; ++x) square(x) = std::pow(f(x) - mean(StateOf(x)), 2);
  return MeanGivenState(b, square);
}

namespace {

/// sum_i dpi(i|row)/dtheta(row,j) q(row,i) with softmax: dpi(i)/dtheta(j) = pi(i) (1[i = j] -
/// pi(j)).
MatD SoftmaxTerm(const MatD& pi, const MatD& q) {
  MatD term = MatD::Zero(pi.rows(), pi.cols());
  for (Index row = 0; row < pi.rows(); ++row) {
    for (Index j = 0; j < pi.cols(); ++j) {
      for (Index i = 0; i < pi.cols(); ++i) {
        term(row, j) += pi(row, i) * ((i == j) - pi(row, j)) * q(row, i);
      }
    }
  }
  return term;
}

}  // namespace

MatD OptionTerm(const Process& process, const Values& v) {
  MatD q(kRows, K);  // Q_O(s,o) at (Row(s,o'), o)
  for (int x = 0; x < kRows; ++x) q.row(x) = v.Q_O.segment(Row(StateOf(x), 0), K).transpose();
  return SoftmaxTerm(process.P, q);
}

MatD ActionTerm(const Process& process, const Values& v) {
  return SoftmaxTerm(process.pi_a, v.Q_A);
}

int Draw(const MatD& table, int row, Rng& rng) {
  const double u = rng.Uniform();
  double below = 0;
  int i = 0;
  for (int j = 0; j + 1 < table.cols(); ++j) {  // without a branch on u: drawn 10^8 times
    below += table(row, j);
    i += u >= below;
  }
  return i;
}

}  // namespace o2v::exact
