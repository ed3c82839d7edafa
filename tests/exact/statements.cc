#include "exact/statements.h"

#include <Eigen/LU>

namespace o2v::exact {
namespace {

constexpr double kRounding = 1e-12;   // of a linear system; spec 9.1
constexpr double kIdentity = 1e-10;   // of sums cut at 1e-14; spec 9.2, 9.3
constexpr double kDifference = 1e-7;  // of central differences; spec 9.4
constexpr double kStep = 1e-6;        // of central differences; spec 9.4
constexpr double kNonzero = 1e-5;  // what no rounding (1e-13), no difference (1e-8) reaches; ours
constexpr double kSigmas = 4;      // of a sampled mean; spec 9.1
constexpr int kReturns = 200000;   // of a sampled mean; spec 9.1
constexpr int kTime = 3;           // t of V_t; spec 9.2

// --- Measures. All of them hand NaN on. ---

double Larger(double a, double b) { return a > b || std::isnan(a) ? a : b; }

double Deviation(const VecD& a, const VecD& b) {
  return (a - b).cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
}

double Least(const VecD& a) { return a.minCoeff<Eigen::PropagateNaN>(); }

/// df/dx by central differences; x is put back.
VecD CentralDifference(double& x, const std::function<VecD()>& f) {
  const double x_0 = x;
  x = x_0 + kStep;
  const VecD above = f();
  x = x_0 - kStep;
  const VecD below = f();
  x = x_0;
  return (above - below) / (2 * kStep);
}

/// Means of vectors that were drawn.
class Sample {
 public:
  explicit Sample(Index size) : sum_(VecD::Zero(size)), sum_of_squares_(VecD::Zero(size)) {}

  void Add(const VecD& drawn) {
    sum_ += drawn;
    sum_of_squares_ += drawn.cwiseAbs2();
    ++n_;
  }

  /// Largest deviation of a mean from its exact value [standard errors].
  double Error(const VecD& exact) const {
    const VecD mean = sum_ / n_;
    const VecD variance = sum_of_squares_ / n_ - mean.cwiseAbs2();
    const VecD standard_error = (variance / n_).cwiseSqrt();
    return Deviation(mean.cwiseQuotient(standard_error), exact.cwiseQuotient(standard_error));
  }

 private:
  VecD sum_, sum_of_squares_;
  double n_ = 0;
};

// --- V_bar (Eq. 7 and 8). ---

/// V_bar(s,o') = sum_o P(o|s,o') Q_O(s,o)
double Bellman(const Instance& instance) {
  const Values v = Solve(instance.process);
  VecD right = VecD::Zero(kRows);
  for (int x = 0; x < kRows; ++x) {
    for (int o = 0; o < K; ++o) right(x) += instance.process.P(x, o) * v.Q_O(Row(StateOf(x), o));
  }
  return Deviation(v.V_bar, right);
}

/// The row from which this instance's sampled ways start.
int StartOf(const Instance& instance) { return static_cast<int>(instance.seed) % kRows; }

/// Mean of G^power over ways from one row, beside what it should be.
double SampledPower(const Instance& instance, int power, const VecD& exact) {
  Rng rng(instance.seed, "returns");
  const int x_0 = StartOf(instance);
  Sample sample(1);
  for (int i = 0; i < kReturns; ++i) {
    double G = 0;
    Rollout(instance.process, x_0, rng, [&](double discount, int x, int, int a) {
      G += discount * instance.process.r(StateOf(x), a);
    });
    sample.Add(VecD::Constant(1, std::pow(G, power)));
  }
  return sample.Error(exact.segment(x_0, 1));
}

/// V_bar(s,o') = E[G | s,o']
double SampledReturn(const Instance& instance) {
  return SampledPower(instance, 1, Solve(instance.process).V_bar);
}

// --- Proposition 3.1. ---

/// Calls visit(Pr(history), x_t) for every history o_0, a_0, s_1, ..., s_t that starts in x.
void ForEachHistory(const Process& process, int t, double probability, int x,
                    const std::function<void(double, int)>& visit) {
  if (t == 0) return visit(probability, x);
  const int s = StateOf(x);
  for (int o = 0; o < K; ++o) {
    for (int a = 0; a < A; ++a) {
      for (int s_next = 0; s_next < S; ++s_next) {
        const double step = process.P(x, o) * process.pi_a(Row(s, o), a) * process.p[a](s, s_next);
        ForEachHistory(process, t - 1, probability * step, Row(s_next, o), visit);
      }
    }
  }
}

/// V_t[s] = E[G_t | s_t = s] by its definition: sum of Pr(history) E[G_t | history] over all
/// histories of t steps that end in s, over the sum of Pr(history). Neither b_t nor V_bar is used.
VecD ValueOfState(const Process& process, const Values& v, const VecD& d_0, int t) {
  // E[G | x] = sum_n gamma^n (T^n r_bar)(x), until the terms are below 1e-14
  VecD G = VecD::Zero(kRows);
  for (VecD term = v.r_bar; term.cwiseAbs().maxCoeff() > 1e-14; term = kGamma * (v.T * term)) {
    G += term;
  }
  VecD numerator = VecD::Zero(S), denominator = VecD::Zero(S);
  for (int x = 0; x < kRows; ++x) {
    ForEachHistory(process, t, d_0(x), x, [&](double probability, int x_t) {
      numerator(StateOf(x_t)) += probability * G(x_t);
      denominator(StateOf(x_t)) += probability;
    });
  }
  return numerator.cwiseQuotient(denominator);
}

/// Where the process is at time t = 3 when it starts from d_0: all that the propositions speak of.
struct Snapshot {
  Snapshot(const Process& process, const VecD& d_0) : v(Solve(process)) {
    V_t = ValueOfState(process, v, d_0, kTime);
    d = d_0;
    for (int t = 0; t < kTime; ++t) d = v.T.transpose() * d;  // d_t = d_0 T^t
    b = GivenState(d);
    M = SecondMoment(process, v);
    variance = VarianceOfReturn(process, v);
  }

  Values v;
  VecD V_t;       // (S)
  VecD d;         // (S K), Pr(s_t = s, o_{t-1} = o')
  VecD b;         // (S K), b_t(o'|s)
  VecD M;         // (S K), E[G^2 | s, o']
  VecD variance;  // (S K), Var(G | s, o')
};

/// From the instance's d_0, which is not uniform.
Snapshot FromStart(const Instance& instance) { return {instance.process, instance.d_0}; }

/// From the law that time does not change.
Snapshot AtRest(const Process& process) { return {process, Stationary(Solve(process).T)}; }

/// V_t[s] = sum_{o'} b_t(o'|s) V_bar(s,o')
double Unbiased(const Snapshot& at) { return Deviation(at.V_t, MeanGivenState(at.b, at.v.V_bar)); }

/// V_t[s] != V_bar(s,o') for a fixed o', whichever
double BiasOfFixedOption(const Instance& instance) {
  const Snapshot at = FromStart(instance);
  VecD bias(K);
  for (int o = 0; o < K; ++o) {
    const VecD V_bar = MeanGivenState(VecD::Unit(K, o).replicate(S, 1), at.v.V_bar);
    bias(o) = Deviation(at.V_t, V_bar);
  }
  return Least(bias);
}

/// V_t[s] != sum_{o'} V_bar(s,o') / K
double BiasOfEqualWeights(const Instance& instance) {
  const Snapshot at = FromStart(instance);
  return Deviation(at.V_t, MeanGivenState(VecD::Constant(kRows, 1.0 / K), at.v.V_bar));
}

/// V_t[s] != V_{t+1}[s]
double ChangeOverTime(const Instance& instance) {
  const Values v = Solve(instance.process);
  return Deviation(ValueOfState(instance.process, v, instance.d_0, kTime),
                   ValueOfState(instance.process, v, instance.d_0, kTime + 1));
}

/// V_t[s] = V_0[s] if d_0 is stationary
double ChangeAtRest(const Instance& instance) {
  const Values v = Solve(instance.process);
  const VecD d = Stationary(v.T);
  return Deviation(ValueOfState(instance.process, v, d, kTime),
                   ValueOfState(instance.process, v, d, 0));
}

/// V - V_n for the stationary V and the solution of a Bellman equation on s alone:
/// V_n = (I - gamma T_s)^{-1} r_s, T_s and r_s with p(o|s) = sum_{o'} b(o'|s) P(o|s,o').
VecD CollapsedDifference(const Snapshot& at) {
  const VecD r_s = MeanGivenState(at.b, at.v.r_bar);
  MatD T_s(S, S);
  for (int s_next = 0; s_next < S; ++s_next) {
    // T_s[s -> s+] = sum_{o'} b(o'|s) sum_o T[(s,o') -> (s+,o)]
    T_s.col(s_next) = MeanGivenState(at.b, at.v.T.middleCols(Row(s_next, 0), K).rowwise().sum());
  }
  const VecD V_n = (MatD::Identity(S, S) - kGamma * T_s).lu().solve(r_s);
  return at.V_t - V_n;
}

/// V[s] != V_n[s]
double CollapsedGap(const Snapshot& at) {
  return Deviation(CollapsedDifference(at), VecD::Zero(S));
}

/// Pr(s_t = s) = sum_{o'} d_t(s,o')
VecD LawOfState(const Snapshot& at) { return MeanGivenState(at.d, VecD::Ones(kRows)); }

/// sum_s d(s) V[s] = sum_s d(s) V_n[s] all the same: T_s leaves d(s) as it is, hence both sides are
/// d r_bar / (1 - gamma).
double CollapsedMean(const Snapshot& at) {
  return std::abs(LawOfState(at).dot(CollapsedDifference(at)));
}

/// The process with P(o|s,o') := P(o|s,0).
Process WithoutPreviousOption(Process process) {
  for (int x = 0; x < kRows; ++x) process.P.row(x) = process.P.row(Row(StateOf(x), 0));
  return process;
}

// --- Proposition 3.2. ---

/// Var(G_t|s) = sum_{o'} b_t(o'|s) M(s,o') - V_t[s]^2
VecD VarianceOfState(const Snapshot& at) { return MeanGivenState(at.b, at.M) - at.V_t.cwiseAbs2(); }

/// Var(G_t|s) = E_{o'}[Var(G_t|s,o')] + Var_{o'}(V_bar(s,o')). The left side is made of M, the
/// right one is not: with Var(G|s,o') := M - V_bar^2 the identity would hold for any M.
double TotalVariance(const Snapshot& at) {
  return Deviation(VarianceOfState(at),
                   MeanGivenState(at.b, at.variance) + VarianceGivenState(at.b, at.v.V_bar));
}

/// Var(G_t|s) - Var(V_bar(s,o_{t-1})|s) >= 0
double RoomAboveValue(const Snapshot& at) {
  return Least(VarianceOfState(at) - VarianceGivenState(at.b, at.v.V_bar));
}

/// Var(G_t|s) - E_{o'}[Var(G_t|s,o')] >= 0
double RoomAboveMean(const Snapshot& at) {
  return Least(VarianceOfState(at) - MeanGivenState(at.b, at.variance));
}

/// M(s,o') = E[G^2 | s,o']
double SampledSecondMoment(const Instance& instance) {
  return SampledPower(instance, 2, SecondMoment(instance.process, Solve(instance.process)));
}

/// Var(V_bar|s) - V_t[s] in units of |V_t[s]| after rewards have been multiplied by
/// c = 2 |V_t[s]| / Var(V_bar|s): the sides grow by c^2 and c. Positive: 1 where V_t[s] > 0,
/// else 3.
double VarianceAboveValue(const Instance& instance) {
  const Snapshot before = FromStart(instance);
  VecD excess(S);
  for (int s = 0; s < S; ++s) {
    Process scaled = instance.process;
    scaled.r *= 2 * std::abs(before.V_t(s)) / VarianceGivenState(before.b, before.v.V_bar)(s);
    const Snapshot at(scaled, instance.d_0);
    const double variance = VarianceGivenState(at.b, at.v.V_bar)(s);
    excess(s) = (variance - at.V_t(s)) / std::abs(at.V_t(s));
  }
  return Least(excess);
}

/// Var(f(i)) under the law d(i).
double Variance(const VecD& d, const VecD& f) {
  return d.dot((f.array() - d.dot(f)).square().matrix());
}

/// Var(V_bar(s_t,o_{t-1})) - Var(V_t(s_t)) > 0
double UnconditionalExcess(const Snapshot& at) {
  return Variance(at.d, at.v.V_bar) - Variance(LawOfState(at), at.V_t);
}

/// Var(V_bar(s_t,o_{t-1})) = Var(V_t(s_t)) + E[Var(V_bar|s_t)]
double UnconditionalIdentity(const Snapshot& at) {
  return std::abs(UnconditionalExcess(at) -
                  LawOfState(at).dot(VarianceGivenState(at.b, at.v.V_bar)));
}

// --- Theorems 3.3 and 3.4. ---

/// dV_bar(x_0)/dtheta_o(x,j) = sum_{n >= 0} gamma^n Pr(x_n = x|x_0) g(x,j)
double OptionGradient(const Instance& instance, const MatD& g) {
  const MatD visits = Visits(Solve(instance.process).T);
  MatD theta_o = instance.theta_o;
  Process moved = instance.process;
  double gap = 0;
  for (int x = 0; x < kRows; ++x) {
    for (int j = 0; j < K; ++j) {
      const VecD numeric = CentralDifference(theta_o(x, j), [&] {
        moved.P = Softmax(theta_o);
        return Solve(moved).V_bar;
      });
      gap = Larger(gap, Deviation(visits.col(x) * g(x, j), numeric));
    }
  }
  return gap;
}

/// g(x,j) = sum_o dP(o|x)/dtheta_o(x,j) Q_O(s,o)
double Theorem33(const Instance& instance) {
  return OptionGradient(instance, OptionTerm(instance.process, Solve(instance.process)));
}

/// The same with sampled options and dP where d ln P belongs: sum_o P(o|x) dP(o|x) Q_O(s,o).
double Theorem33WithoutLog(const Instance& instance) {
  const MatD& P = instance.process.P;
  const Values v = Solve(instance.process);
  MatD g = MatD::Zero(kRows, K);
  for (int x = 0; x < kRows; ++x) {
    for (int j = 0; j < K; ++j) {
      for (int o = 0; o < K; ++o) {
        const double dP = P(x, o) * ((o == j) - P(x, j));
        g(x, j) += P(x, o) * dP * v.Q_O(Row(StateOf(x), o));
      }
    }
  }
  return OptionGradient(instance, g);
}

/// What a policy decided on, and what that was worth.
struct Decision {
  int row, drawn;
  double advantage;
};

/// Mean of sum_n gamma^n d ln policy(drawn_n|row_n)/dtheta(row,j) advantage_n over ways from one
/// row, beside what it should be; d ln policy(drawn|row)/dtheta(row,j) = 1[drawn = j] -
/// policy(j|row). The policy is P or pi_a; decision(x_n, o_n, a_n) is what it decided.
template <typename F>
double SampledGradient(const Instance& instance, const MatD& policy, const MatD& exact,
                       F decision) {
  Rng rng(instance.seed, "gradients");
  Sample sample(exact.size());
  MatD estimate(exact.rows(), exact.cols());
  for (int i = 0; i < kReturns; ++i) {
    estimate.setZero();
    Rollout(instance.process, StartOf(instance), rng, [&](double discount, int x, int o, int a) {
      const auto [row, drawn, advantage] = decision(x, o, a);
      for (int j = 0; j < policy.cols(); ++j) {
        estimate(row, j) += discount * ((drawn == j) - policy(row, j)) * advantage;
      }
    });
    sample.Add(estimate.reshaped());
  }
  return sample.Error(exact.reshaped());
}

/// dV_bar(x_0)/dtheta_o(x,j) = E[sum_n gamma^n d ln P(o_n|x_n)/dtheta_o(x,j)
/// (Q_O(s_n,o_n) - V_bar(x_n))]
double SampledOptionGradient(const Instance& instance) {
  const Values v = Solve(instance.process);
  const VecD visits = Visits(v.T).row(StartOf(instance));
  const MatD exact = visits.asDiagonal() * OptionTerm(instance.process, v);
  return SampledGradient(instance, instance.process.P, exact, [&](int x, int o, int) {
    return Decision{x, o, v.Q_O(Row(StateOf(x), o)) - v.V_bar(x)};
  });
}

/// dQ_O(y_0)/dtheta_a(y,j) = sum_{n >= 0} gamma^n Pr(y_n = y|y_0) h(y,j)
double Theorem34(const Instance& instance) {
  const MatD h = ActionTerm(instance.process, Solve(instance.process));
  const MatD visits = Visits(ActionChain(instance.process));
  MatD theta_a = instance.theta_a;
  Process moved = instance.process;
  double gap = 0;
  for (int y = 0; y < kRows; ++y) {
    for (int j = 0; j < A; ++j) {
      const VecD numeric = CentralDifference(theta_a(y, j), [&] {
        moved.pi_a = Softmax(theta_a);
        return Solve(moved).Q_O;
      });
      gap = Larger(gap, Deviation(visits.col(y) * h(y, j), numeric));
    }
  }
  return gap;
}

/// Pr(y_0 = (s,o)) = sum_{o'} d_0(s,o') P(o|s,o')
VecD LawAfterOption(const Process& process, const VecD& d_0) {
  VecD e_0 = VecD::Zero(kRows);
  for (int x = 0; x < kRows; ++x) {
    for (int o = 0; o < K; ++o) e_0(Row(StateOf(x), o)) += d_0(x) * process.P(x, o);
  }
  return e_0;
}

/// dV_bar(x_0)/dtheta_a(y,j) = sum_o P(o|x_0) dQ_O(s_0,o)/dtheta_a(y,j)
/// = E[sum_n gamma^n d ln pi_a(a_n|y_n)/dtheta_a(y,j) (Q_A(s_n,o_n,a_n) - Q_O(s_n,o_n))]
double SampledActionGradient(const Instance& instance) {
  const Process& process = instance.process;
  const Values v = Solve(process);
  const VecD e_0 = LawAfterOption(process, VecD::Unit(kRows, StartOf(instance)));
  const VecD visits = Visits(ActionChain(process)).transpose() * e_0;
  const MatD exact = visits.asDiagonal() * ActionTerm(process, v);
  return SampledGradient(instance, process.pi_a, exact, [&](int x, int o, int a) {
    const int y = Row(StateOf(x), o);
    return Decision{y, a, v.Q_A(y, a) - v.Q_O(y)};
  });
}

/// Both policies read one table W := theta_o: d(d_0 V_bar)/dW(row,j) is
///   sum_n gamma^n Pr(x_n = row) g(row,j) + sum_n gamma^n Pr(y_n = row) h(row,j).
/// Without the second term W learns from the option policy only, as an embedding does that the
/// action policy reads detached.
double SharedTable(const Instance& instance, bool second_term) {
  static_assert(K == A, "one table for both policies");
  MatD W = instance.theta_o;
  Process process = instance.process;
  const auto solve = [&] {
    process.P = process.pi_a = Softmax(W);
    return Solve(process);
  };
  const Values v = solve();
  const VecD e_0 = LawAfterOption(process, instance.d_0);
  const VecD x_visits = Visits(v.T).transpose() * instance.d_0;
  const VecD y_visits = Visits(ActionChain(process)).transpose() * e_0;
  MatD total = x_visits.asDiagonal() * OptionTerm(process, v);
  if (second_term) total += y_visits.asDiagonal() * ActionTerm(process, v);

  double gap = 0;
  for (Index i = 0; i < W.size(); ++i) {
    const VecD numeric = CentralDifference(
        W.data()[i], [&]() -> VecD { return VecD::Constant(1, instance.d_0.dot(solve().V_bar)); });
    gap = Larger(gap, std::abs(total.data()[i] - numeric(0)));
  }
  return gap;
}

// --- DAC. ---

/// V_bar = U and Q_O = Q_Omega with P(o|s,o') := (1 - beta_{o'}(s)) 1[o = o'] + beta_{o'}(s)
/// pi(o|s). The option-critic equations are iterated as they stand, without P:
///   Q_Omega(s,o) = sum_a pi_a(a|s,o) [r(s,a) + gamma sum_{s+} p(s+|s,a) U(o,s+)]
///   U(o,s+) = (1 - beta_o(s+)) Q_Omega(s+,o) + beta_o(s+) sum_{o+} pi(o+|s+) Q_Omega(s+,o+)
double Dac(const Instance& instance) {
  Rng rng(instance.seed, "dac");
  const MatD pi = RandomLaws(S, K, rng);
  const MatD beta = RandomLaws(kRows, 2, rng).col(0);  // beta_o(s) at Row(s,o)
  Process process = instance.process;
  for (int x = 0; x < kRows; ++x) {
    for (int o = 0; o < K; ++o) {
      process.P(x, o) = (1 - beta(x)) * (o == OptionOf(x)) + beta(x) * pi(StateOf(x), o);
    }
  }
  VecD Q_Omega = VecD::Zero(kRows), U = VecD::Zero(kRows);
  for (int n = 0; n < 500; ++n) {  // 0.9^500 = 1e-23
    for (int s = 0; s < S; ++s) {
      for (int o = 0; o < K; ++o) {
        const double master = pi.row(s).dot(Q_Omega.segment(Row(s, 0), K));
        U(Row(s, o)) = (1 - beta(Row(s, o))) * Q_Omega(Row(s, o)) + beta(Row(s, o)) * master;
      }
    }
    Q_Omega.setZero();
    for (int y = 0; y < kRows; ++y) {
      for (int a = 0; a < A; ++a) {
        double target = process.r(StateOf(y), a);
        for (int s_next = 0; s_next < S; ++s_next) {
          target += kGamma * process.p[a](StateOf(y), s_next) * U(Row(s_next, OptionOf(y)));
        }
        Q_Omega(y) += process.pi_a(y, a) * target;
      }
    }
  }
  const Values v = Solve(process);
  return Larger(Deviation(v.V_bar, U), Deviation(v.Q_O, Q_Omega));
}

// --- IOPG, with sizes of its own. ---

/// An episode of 4 steps with 3 options, as IOPG sees it.
struct Episode {
  static constexpr int kSteps = 4, kOptions = 3;

  explicit Episode(std::uint64_t seed) {
    Rng rng(seed, "iopg");
    z = RandomNormals(kOptions, kSteps, rng);
    b = RandomNormals(kOptions, kSteps, rng);
    ell = RandomNormals(kOptions, kSteps, rng);
    A_t = RandomNormals(kSteps, 1, rng);
  }

  MatD z;    // (3, 4), logits of pi(.|s_t)
  MatD b;    // (3, 4), logits of beta_i(s_t)
  MatD ell;  // (3, 4), ln p_t[i] = ln pi_i(a_t|s_t)
  VecD A_t;  // (4), advantages

  VecD pi(int t) const { return Softmax(z.col(t).transpose()).transpose(); }
  VecD beta(int t) const { return 1 / (1 + (-b.col(t).array()).exp()); }
  VecD p(int t) const { return ell.col(t).array().exp(); }
  /// P_t[i,j] = (1 - beta_i(s_t)) 1[i = j] + beta_i(s_t) pi_j(s_t)
  MatD P(int t) const {
    return MatD((1 - beta(t).array()).matrix().asDiagonal()) + beta(t) * pi(t).transpose();
  }
};

/// J_n, the probability of the first n actions: sum over all option sequences o_1, ..., o_n of
/// pi(o_1) p_1[o_1] P_2[o_1,o_2] p_2[o_2] ... Returns ln J_n - ln J_{n-1}.
VecD LogProbabilities(const Episode& e) {
  VecD J = VecD::Zero(Episode::kSteps);
  const std::function<void(int, int, double)> extend = [&](int t, int o_prev, double probability) {
    if (t == Episode::kSteps) return;
    for (int o = 0; o < Episode::kOptions; ++o) {
      const double choice = t == 0 ? e.pi(0)(o) : e.P(t)(o_prev, o);
      const double extended = probability * choice * e.p(t)(o);
      J(t) += extended;
      extend(t + 1, o, extended);
    }
  };
  extend(0, -1, 1.0);
  VecD ln_c = J.array().log();
  for (int t = Episode::kSteps - 1; t > 0; --t) ln_c(t) -= ln_c(t - 1);
  return ln_c;
}

/// Occupancies of the options given the history.
struct Filter {
  explicit Filter(const Episode& e)
      : m(Episode::kOptions, Episode::kSteps), w(m), c(Episode::kSteps) {
    for (int t = 0; t < Episode::kSteps; ++t) {
      // m_1 = pi(.|s_1), m_{t+1}[j] = sum_i w_t[i] P_{t+1}[i,j]
      m.col(t) = t == 0 ? e.pi(0) : VecD(e.P(t).transpose() * w.col(t - 1));
      // c_t = sum_i m_t[i] p_t[i]
      c(t) = m.col(t).dot(e.p(t));
      // w_t[i] = m_t[i] p_t[i] / c_t
      w.col(t) = m.col(t).cwiseProduct(e.p(t)) / c(t);
    }
  }

  MatD m, w;  // (3, 4)
  VecD c;     // (4)
};

/// prod_t c_t / J_4 - 1
double IopgProduct(const Instance& instance) {
  const Episode e(instance.seed);
  return std::abs(Filter(e).c.prod() / std::exp(LogProbabilities(e).sum()) - 1);
}

/// The backward recursion for L = -sum_t A_t ln c_t beside differences of the enumerated L.
double IopgGradient(const Instance& instance) {
  Episode e(instance.seed);
  const Filter f(e);
  MatD dz(e.z), db = MatD::Zero(e.b.rows(), e.b.cols()), dell(e.ell);
  VecD dw = VecD::Zero(Episode::kOptions);
  for (int t = Episode::kSteps - 1; t >= 0; --t) {
    const VecD pi = e.pi(t), beta = e.beta(t), p = e.p(t), m = f.m.col(t), w = f.w.col(t);
    // d(m p)_i = -A_t / c_t + (dw_i - sum_k dw_k w_k) / c_t
    const VecD du = (dw.array() - dw.dot(w) - e.A_t(t)) / f.c(t);
    dell.col(t) = du.cwiseProduct(m).cwiseProduct(p);
    const VecD dm = du.cwiseProduct(p);
    // dz_j = (sum_i beta_i w_{t-1}[i]) pi_j (dm_j - sum_k pi_k dm_k); at t = 1 the sum is 1
    const double chosen = t == 0 ? 1 : beta.dot(f.w.col(t - 1));
    dz.col(t) = chosen * pi.array() * (dm.array() - pi.dot(dm));
    if (t == 0) continue;
    // dbeta_i = w_{t-1}[i] (sum_j dm_j pi_j - dm_i)
    db.col(t) =
        f.w.col(t - 1).array() * (pi.dot(dm) - dm.array()) * beta.array() * (1 - beta.array());
    dw = e.P(t) * dm;
  }
  double gap = 0;
  const auto compare = [&](MatD& x, const MatD& dx) {
    for (Index i = 0; i < x.size(); ++i) {
      const VecD numeric = CentralDifference(x.data()[i], [&]() -> VecD {
        return VecD::Constant(1, -e.A_t.dot(LogProbabilities(e)));
      });
      gap = Larger(gap, std::abs(dx.data()[i] - numeric(0)));
    }
  };
  compare(e.z, dz);
  compare(e.b, db);
  compare(e.ell, dell);
  return gap;
}

}  // namespace

std::vector<Statement> AllStatements() {
  constexpr auto kBelow = Statement::Relation::kBelow, kAbove = Statement::Relation::kAbove;
  const auto from_start = [](double (*f)(const Snapshot&)) {
    return [f](const Instance& instance) { return f(FromStart(instance)); };
  };
  const auto at_rest = [](double (*f)(const Snapshot&)) {
    return [f](const Instance& instance) { return f(AtRest(instance.process)); };
  };
  return {
      // Check 1.
      {"Equation 8 (Bellman)", "V_bar(s o') and sum_o P(o|s o') Q_O(s o)", kBelow, kRounding,
       Bellman},
      // Check 2.
      {"Equation 8 sampled", "V_bar and the mean of 200000 returns [standard errors]", kBelow,
       kSigmas, SampledReturn},
      // Check 3, and the readings that do not hold.
      {"Proposition 3.1 in the sense in which it is true",
       "V_t[s] over all histories of 3 steps and sum_o' b_t(o'|s) V_bar(s o')", kBelow, kIdentity,
       from_start(Unbiased)},
      {"Proposition 3.1 in the sense in which it is true (stationary)",
       "the same from the stationary law", kBelow, kIdentity, at_rest(Unbiased)},
      {"Proposition 3.1 for a fixed o': false", "V_t[s] and V_bar(s o') with the better o'", kAbove,
       kNonzero, BiasOfFixedOption},
      {"Proposition 3.1 for weights 1/K: false", "V_t[s] and sum_o' V_bar(s o') / K", kAbove,
       kNonzero, BiasOfEqualWeights},
      {"Proposition 3.1 with one V for all t: false", "V_3[s] and V_4[s]", kAbove, kNonzero,
       ChangeOverTime},
      {"Proposition 3.1 with one V for all t (stationary)", "V_3[s] and V_0[s]", kBelow, kIdentity,
       ChangeAtRest},
      // Check 4.
      {"Bellman equation of V on s alone: false", "V and V_n of the chain with o' averaged out",
       kAbove, kNonzero, at_rest(CollapsedGap)},
      {"Bellman equation of V on s alone if P(o|s o') = P(o|s)", "the same", kBelow, kRounding,
       [](const Instance& i) { return CollapsedGap(AtRest(WithoutPreviousOption(i.process))); }},
      {"Bellman equation of V on s alone in the mean", "sum_s d(s) V[s] and sum_s d(s) V_n[s]",
       kBelow, kIdentity, at_rest(CollapsedMean)},
      // Checks 5 to 7.
      {"Proposition 3.2 (law of total variance)",
       "Var(G_t|s) and E[Var(G_t|s o')|s] + Var(V_bar|s)", kBelow, kIdentity,
       from_start(TotalVariance)},
      {"Proposition 3.2 (law of total variance; stationary)", "the same from the stationary law",
       kBelow, kIdentity, at_rest(TotalVariance)},
      {"Proposition 3.2 in the sense in which it is true (i)",
       "least Var(G_t|s) - Var(V_bar(s o_{t-1})|s)", kAbove, 0, from_start(RoomAboveValue)},
      {"Proposition 3.2 in the sense in which it is true (ii)",
       "least Var(G_t|s) - E[Var(G_t|s o')|s]", kAbove, 0, from_start(RoomAboveMean)},
      {"Proposition 3.2 sampled", "M and the mean of 200000 squared returns [standard errors]",
       kBelow, kSigmas, SampledSecondMoment},
      // The readings of Proposition 3.2 that do not hold.
      {"Proposition 3.2 as Var(V_bar) <= V: false",
       "least (Var(V_bar|s) - V_t[s]) / |V_t[s]| with rewards times 2 |V_t[s]| / Var(V_bar|s)",
       kAbove, kNonzero, VarianceAboveValue},
      {"Proposition 3.2 as Var(V_bar) <= Var(V_t): false",
       "Var(V_bar(s_t o_{t-1})) - Var(V_t(s_t))", kAbove, kNonzero,
       from_start(UnconditionalExcess)},
      {"Proposition 3.2 as Var(V_bar) <= Var(V_t): false (stationary)", "the same", kAbove,
       kNonzero, at_rest(UnconditionalExcess)},
      {"Proposition 3.2 without condition", "that difference and E[Var(V_bar|s_t)]", kBelow,
       kIdentity, from_start(UnconditionalIdentity)},
      // Check 8, the reading that does not hold, check 11.
      {"Theorem 3.3 (option policy gradient)",
       "(I - gamma T)^-1 g and central differences of V_bar", kBelow, kDifference, Theorem33},
      {"Theorem 3.3 with dP under sampled options: false",
       "the same with sum_o P(o|s o') dP(o|s o') Q_O(s o) for g", kAbove, kNonzero,
       Theorem33WithoutLog},
      {"Theorem 3.3 sampled",
       "that gradient and the mean of 200000 sum_n gamma^n d ln P (Q_O - V_bar) [standard errors]",
       kBelow, kSigmas, SampledOptionGradient},
      // Check 9, and check 11 of the action policy.
      {"Theorem 3.4 (action policy gradient)", "(I - gamma U)^-1 h and central differences of Q_O",
       kBelow, kDifference, Theorem34},
      {"Theorem 3.4 sampled",
       "that gradient after o_0 ~ P and the mean of 200000 sum_n gamma^n d ln pi_a (Q_A - Q_O) "
       "[standard errors]",
       kBelow, kSigmas, SampledActionGradient},
      // Check 10.
      {"Theorems 3.3 and 3.4 with shared parameters",
       "both terms and central differences of d_0 V_bar", kBelow, kDifference,
       [](const Instance& i) { return SharedTable(i, /*second_term=*/true); }},
      {"Theorem 3.3 alone with shared parameters: false", "the same without the second term",
       kAbove, kNonzero, [](const Instance& i) { return SharedTable(i, /*second_term=*/false); }},
      // Check 12.
      {"Equivalence with DAC",
       "U and Q_Omega of the option-critic equations; V_bar and Q_O with P := call and return",
       kBelow, kRounding, Dac},
      // Checks 13 and 14.
      {"IOPG (product of c_t)", "prod_t c_t / sum over all 81 option sequences - 1", kBelow,
       kRounding, IopgProduct},
      {"IOPG (gradient)", "the recursion and central differences of the sum", kBelow, kDifference,
       IopgGradient},
  };
}

Worst WorstOf(const Statement& statement) {
  const bool below = statement.relation == Statement::Relation::kBelow;
  Worst worst{statement.gap(Instance(0)), 0};
  for (int seed = 1; seed < kInstances; ++seed) {
    const double gap = statement.gap(Instance(static_cast<std::uint64_t>(seed)));
    if (std::isnan(gap) || (below ? gap > worst.gap : gap < worst.gap)) worst = {gap, seed};
    if (std::isnan(gap)) break;
  }
  return worst;
}

}  // namespace o2v::exact
