#include "algo/option_nets.h"

#include "algo/option_policy.h"
#include "base/check.h"
#include "dist/categorical.h"
#include "nn/activation.h"
#include "nn/embedding.h"

namespace o2v {
namespace {

std::string OptionName(Index k, const std::string& part) {
  return "option" + std::to_string(k) + "." + part;
}

/// Sorts samples 0..B-1 by their option.
void SortByOption(std::span<const int> o, Index K, std::vector<int>& sample,
                  std::vector<Index>& start) {
  start.assign(std::size_t(K) + 1, 0);
  sample.resize(o.size());
  for (const int k : o) ++start[std::size_t(k) + 1];
  for (std::size_t k = 1; k < start.size(); ++k) start[k] += start[k - 1];
  // start[k] counts up to the end of option k and is put back afterwards.
  for (std::size_t b = 0; b < o.size(); ++b) {
    sample[std::size_t(start[std::size_t(o[b])]++)] = int(b);
  }
  for (std::size_t k = start.size() - 1; k > 0; --k) start[k] = start[k - 1];
  start[0] = 0;
}

}  // namespace

// ---- One network per option ---------------------------------------------------------------------

PerOptionMlps::PerOptionMlps(const std::string& name, Index K, Index S, Index h, Index n_out,
                             Activation activation, const Initialiser& init) {
  for (Index k = 0; k < K; ++k) {
    nets_.emplace_back(OptionName(k, name + ".body"), OptionName(k, name + ".head"), S, h, n_out,
                       activation, init);
  }
}

void PerOptionMlps::ForwardOne(const ConstMatRef& s, std::span<const int> o, Cache& c) const {
  Check(Index(o.size()) == s.cols(), "option networks: got ", o.size(), " options for ", s.cols(),
        " samples");
  c.all = false;
  SortByOption(o, K(), c.sample, c.start);
  c.s.resize(s.rows(), s.cols());
  for (Index i = 0; i < s.cols(); ++i) c.s.col(i) = s.col(c.sample[std::size_t(i)]);
  Forward(c.s, c);
  c.out.resize(c.y.rows(), s.cols());
  for (Index i = 0; i < s.cols(); ++i) c.out.col(c.sample[std::size_t(i)]) = c.y.col(i);
}

void PerOptionMlps::ForwardAll(const ConstMatRef& s, Cache& c) const {
  c.all = true;
  c.start.resize(nets_.size() + 1);
  for (Index k = 0; k <= K(); ++k) c.start[std::size_t(k)] = k * s.cols();
  Forward(s, c);
  c.out = c.y;
}

void PerOptionMlps::Forward(const ConstMatRef& s, Cache& c) const {
  const Index n = c.start.back(), h = nets_[0].head.W.value.cols();
  c.h0.resize(h, n);
  c.h1.resize(h, n);
  c.y.resize(nets_[0].head.W.value.rows(), n);
  for (std::size_t k = 0; k < nets_.size(); ++k) {
    const Index start = c.start[k], m = c.start[k + 1] - start;
    if (m == 0) continue;
    const Mlp& net = nets_[k];
    auto h1 = c.h1.middleCols(start, m);
    net.body.Forward(s.middleCols(c.all ? 0 : start, m), c.h0.middleCols(start, m), h1);
    net.head.Forward(h1, c.y.middleCols(start, m));
  }
}

void PerOptionMlps::Backward(const ConstMatRef& s, Cache& c) {
  const Index n = c.start.back();
  c.dh0.resize(c.h0.rows(), n);
  c.dh1.resize(c.h1.rows(), n);
  if (!c.all) {
    c.dy.resize(c.y.rows(), n);
    for (Index i = 0; i < n; ++i) c.dy.col(i) = c.dout.col(c.sample[std::size_t(i)]);
  }
  const Mat& dy_sorted = c.all ? c.dout : c.dy;
  for (std::size_t k = 0; k < nets_.size(); ++k) {
    const Index start = c.start[k], m = c.start[k + 1] - start;
    if (m == 0) continue;
    Mlp& net = nets_[k];
    const auto dy = dy_sorted.middleCols(start, m);
    const auto h1 = c.h1.middleCols(start, m);
    auto dh1 = c.dh1.middleCols(start, m);
    net.head.AddGrad(h1, dy);
    net.head.BackwardInput(dy, dh1);
    net.body.Backward(c.all ? s.middleCols(0, m) : ConstMatRef(c.s.middleCols(start, m)),
                      c.h0.middleCols(start, m), h1, dh1, c.dh0.middleCols(start, m));
  }
}

std::vector<Param*> PerOptionMlps::Params() {
  std::vector<Param*> params;
  for (Mlp& net : nets_) Append(params, net.Params());
  return params;
}

// ---- Intra-option policies ----------------------------------------------------------------------

IntraOptionPolicies::IntraOptionPolicies(Index K, Index S, Index A, Index h, Activation activation,
                                         const Initialiser& init)
    : mu_("mu", K, S, h, A, activation, init) {
  for (Index k = 0; k < K; ++k) rho_.emplace_back(OptionName(k, "rho"), A, 1);
}

void IntraOptionPolicies::MakeSigma(Cache& c) const {
  c.sigma_of.resize(rho_[0].value.rows(), Index(rho_.size()));
  for (std::size_t k = 0; k < rho_.size(); ++k) c.sigma_of.col(Index(k)) = rho_[k].value.col(0);
  Softplus(c.sigma_of);
}

void IntraOptionPolicies::ForwardOne(const ConstMatRef& s, std::span<const int> o, Cache& c) const {
  mu_.ForwardOne(s, o, c.nets);
  Tanh(c.nets.out);
  MakeSigma(c);
  c.sigma.resize(c.sigma_of.rows(), s.cols());
  GatherColumns(c.sigma_of, o, c.sigma);
}

void IntraOptionPolicies::ForwardAll(const ConstMatRef& s, Cache& c) const {
  mu_.ForwardAll(s, c.nets);
  Tanh(c.nets.out);
  MakeSigma(c);
  c.sigma.resize(c.sigma_of.rows(), c.nets.out.cols());
  for (Index k = 0; k < c.sigma_of.cols(); ++k) {
    c.sigma.middleCols(k * s.cols(), s.cols()).colwise() = c.sigma_of.col(k);
  }
}

void IntraOptionPolicies::Backward(const ConstMatRef& s, std::span<const int> o, Cache& c) {
  ActivationBackward(Activation::kTanh, c.nets.out, c.nets.dout);
  mu_.Backward(s, c.nets);
  c.dsigma_of.setZero(c.sigma_of.rows(), c.sigma_of.cols());
  if (c.nets.all) {
    for (Index k = 0; k < c.sigma_of.cols(); ++k) {
      c.dsigma_of.col(k) = c.dsigma.middleCols(k * s.cols(), s.cols()).rowwise().sum();
    }
  } else {
    ScatterColumns(c.dsigma, o, c.dsigma_of);
  }
  SoftplusBackward(c.sigma_of, c.dsigma_of);
  for (std::size_t k = 0; k < rho_.size(); ++k) rho_[k].grad.col(0) += c.dsigma_of.col(Index(k));
}

std::vector<Param*> IntraOptionPolicies::Params(Index k) {
  std::vector<Param*> params = mu_[k].Params();
  params.push_back(&rho_[std::size_t(k)]);
  return params;
}

// ---- Option network -----------------------------------------------------------------------------

OptionNets::OptionNets(Index K, Index S, Index A, Index h, Activation activation, CriticHead head,
                       const Initialiser& init)
    : master("master.body", "master.head", S, h, K, activation, init) {
  const bool q = head == CriticHead::kQ;
  critic = Mlp("critic.body", q ? "critic.q" : "critic.u", S, h, q ? K : K + 1, activation, init);
  idle_head = Linear(q ? "critic.u" : "critic.q", h, q ? K + 1 : K);
  init.Orthogonal(idle_head.W.value, kHeadGain);
  policy = IntraOptionPolicies(K, S, A, h, activation, init);
  beta = PerOptionMlps("beta", K, S, h, 1, activation, init);
}

void OptionNets::Beta(const ConstMatRef& s, std::span<const int> o, bool all, BetaCache& c) const {
  const Index B = s.cols();
  c.beta.resize(beta.K(), B);
  if (all) {
    beta.ForwardAll(s, c.nets);
    for (Index k = 0; k < beta.K(); ++k) c.beta.row(k) = c.nets.out.middleCols(k * B, B);
    Sigmoid(c.beta);
  } else {
    beta.ForwardOne(s, o, c.nets);
    Sigmoid(c.nets.out);
    c.beta.setZero();
    for (Index b = 0; b < B; ++b) c.beta(o[std::size_t(b)], b) = c.nets.out(0, b);
  }
}

void OptionNets::BackwardBeta(const ConstMatRef& s, std::span<const int> o, BetaCache& c) {
  const Index B = s.cols();
  c.nets.dout.resize(1, c.nets.out.cols());
  if (c.nets.all) {
    for (Index k = 0; k < beta.K(); ++k) c.nets.dout.middleCols(k * B, B) = c.db.row(k);
  } else {
    for (Index b = 0; b < B; ++b) c.nets.dout(0, b) = c.db(o[std::size_t(b)], b);
  }
  beta.Backward(s, c.nets);
}

void OptionNets::Master(const ConstMatRef& s, CallAndReturnCache& c) const {
  master.Forward(s, c.master);
  LogSoftmax(c.master.out, c.log_pi, c.pi);
}

void OptionNets::BetaAndMask(const ConstMatRef& s, std::span<const int> o_prev, Fidelity beta_index,
                             CallAndReturnCache& c) const {
  Beta(s, o_prev, beta_index == Fidelity::kReleased, c.beta);
  c.M.resize(beta.K(), s.cols());
  OneHot(o_prev, c.M);
}

void OptionNets::CallAndReturn(const ConstMatRef& s, std::span<const int> o_prev,
                               std::span<const char> init, const Mat& pi, Fidelity beta_index,
                               CallAndReturnCache& c) const {
  BetaAndMask(s, o_prev, beta_index, c);
  MixCallAndReturn(pi, c.beta.beta, c.M, o_prev, init, beta_index, c.pi_hat);
}

std::vector<Param*> OptionNets::UsedParams() {
  std::vector<Param*> used = Params();
  for (const Param* idle : idle_head.Params()) std::erase(used, idle);
  return used;
}

std::vector<Param*> OptionNets::Params() {
  std::vector<Param*> params = master.Params();
  Append(params, critic.Params());
  Append(params, idle_head.Params());
  for (Index k = 0; k < beta.K(); ++k) {
    Append(params, policy.Params(k));
    Append(params, beta[k].Params());
  }
  return params;
}

}  // namespace o2v
