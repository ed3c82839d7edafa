#include <memory>

#include "algo/losses.h"
#include "base/check.h"
#include "dist/categorical.h"
#include "dist/diag_gaussian.h"
#include "gradcheck/problem.h"
#include "nn/attention_block.h"
#include "nn/embedding.h"
#include "random_mat.h"

namespace o2v {
namespace {

constexpr int kB = 10;

class Option2VecProblem final : public Problem {
 public:
  Option2VecProblem(const Setup& setup, std::uint64_t seed);

 private:
  struct OptionPass {
    Mat log_P, P;  // (K, B)
  };

  template <typename Layer>
  Layer& Load(Layer& layer);
  void HiddenLayers(const std::string& body, const Mat& x);
  void VisitRelus();
  OptionPass Options(const Mat& query_embedding);
  double OptionObjective(const OptionPass& base, const Mat& W_o, const Mat& q);

  Expect Expected(int stage, const std::string& name) const override;
  std::function<double()> LossOf(int stage, const std::string& name, const Batch& batch,
                                 const FixedDraws& fixed) override;
  bool IsOutput(int stage, const std::string& name, const Batch& sample) const override;
  void Sample(int b, Batch& sample, FixedDraws& fixed) const override;

  std::function<double()> option_objective_;  // of W_o
};

Option2VecProblem::Option2VecProblem(const Setup& setup, std::uint64_t seed)
    : Problem(setup, seed) {
  batch_.Resize(kS, kA, kB);
  batch_.s = RandomMat(kS, kB, rng_);
  batch_.o = ShuffledOptions(kB, kK, rng_);
  batch_.o_prev = ShuffledOptions(kB, kK, rng_);
  for (int b = 0; b < kB; ++b) batch_.init[std::size_t(b)] = b % 3 == 1;
  fixed_.o = ShuffledOptions(kB, kK, rng_);
  const Switches& sw = setup_.switches;
  if (sw.o2v_dropout > 0) {
    const Index n = kB * (Released(sw.o2v_query) ? 2 : 1);
    for (const Index rows : {Index(setup_.heads * kK), Index(kD), Index(kF), Index(kD)}) {
      Mat keep = Mat::Ones(rows, n);
      for (double& k : keep.reshaped()) k = rng_.Uniform() < sw.o2v_dropout ? 0 : 1;
      fixed_.dropout.push_back(keep);
    }
  }

  // What the network says, so that old log-probabilities and targets can be put where they are
  // wanted.
  const std::vector<int>& fed = Released(sw.o2v_option_in_update) ? fixed_.o : batch_.o;
  Mat mu, sigma, q;
  algo_->ActionPolicy(batch_.s, fed, mu, sigma);
  algo_->OptionValues(batch_.s, fed, q);
  batch_.a = mu + sigma.cwiseProduct(RandomMat(kA, kB, rng_));
  Vec logp;
  GaussianLogProb(batch_.a, mu, sigma, logp);
  const Mat W_o = Tensor("embed.W_o");
  const OptionPass pass = Options(W_o);
  for (int b = 0; b < kB; ++b) {
    const std::size_t i = std::size_t(b);
    Place(batch_.action, b, logp(b), q(fed[i], b));
    Place(batch_.option, b, pass.log_P(batch_.o[i], b), pass.P.col(b).dot(q.col(b)));
  }
  VisitRelus();

  option_objective_ = [this, pass, W_o, q] { return OptionObjective(pass, W_o, q); };
  const double total = algo_->Loss(0, batch_, &fixed_).total, ours = option_objective_();
  Check(std::abs(ours - total) < 1e-12, "option stage: the loss is ", total, ", from the outputs ",
        ours);
}

template <typename Layer>
Layer& Option2VecProblem::Load(Layer& layer) {
  for (Param* p : layer.Params()) p->value = Tensor(p->name);
  return layer;
}

void Option2VecProblem::HiddenLayers(const std::string& body, const Mat& x) {
  Relu(Affine(body + ".1", Relu(Affine(body + ".0", x))));
}

/// The option policy in textbook order, its dropout included. `query_embedding` holds the columns
/// that the query reads; the attention's memory is the network's W_o.
Option2VecProblem::OptionPass Option2VecProblem::Options(const Mat& query_embedding) {
  const Switches& sw = setup_.switches;
  const bool two = Released(sw.o2v_query);
  Mat o_hat(kD, kB), x(kD, two ? 2 * kB : kB);
  GatherColumns(query_embedding, batch_.o_prev, o_hat);
  LayerNorm norm(two ? "state.ln" : "query.ln", kD);
  LayerNorm::Cache norm_cache;
  const Mat token = Relu(two ? Affine("state", batch_.s) : Affine("query", Stack(batch_.s, o_hat)));
  Load(norm).Forward(token, norm_cache, x.leftCols(kB));
  if (two) x.rightCols(kB) = o_hat;

  AttentionBlock block("attention", "block", kD, setup_.heads, kF);
  AttentionBlock::Cache cache;
  AttentionBlock::Masks masks;
  MemoryAttention::Memory memory;
  if (!fixed_.dropout.empty()) {
    const double keep = 1 / (1 - sw.o2v_dropout);
    masks = {keep * fixed_.dropout[0], keep * fixed_.dropout[1], keep * fixed_.dropout[2],
             keep * fixed_.dropout[3]};
  }
  Load(block).attention.Project(Tensor("embed.W_o"), memory);
  block.Forward(x, memory, fixed_.dropout.empty() ? nullptr : &masks, cache);
  Relu(Affine("block.ffn.0", cache.y));

  Mat z =
      Affine("logits", two ? Stack(cache.out.leftCols(kB), cache.out.rightCols(kB)) : cache.out);
  for (Index b = 0; b < kB; ++b) {
    if (!batch_.init[std::size_t(b)]) continue;
    const Mat z_init = Affine("init.1", Relu(Affine("init.0", batch_.s.col(b))));
    z.col(b) = Released(sw.o2v_init_relu) ? Relu(z_init) : z_init;
  }
  OptionPass pass;
  LogSoftmax(z, pass.log_P, pass.P);
  return pass;
}

/// Takes the inputs of all ReLUs (those of the option policy were taken with its outputs) into
/// margin_.
void Option2VecProblem::VisitRelus() {
  const Mat& W_o = Tensor("embed.W_o");
  for (const std::vector<int>* o : {&batch_.o, &fixed_.o}) {
    Mat o_hat(kD, kB);
    GatherColumns(W_o, *o, o_hat);
    const Mat x = Stack(batch_.s, o_hat);
    HiddenLayers("action.body", x);
    if (Released(setup_.switches.o2v_critic)) {
      LayerNorm norm("critic.ln", kS + kD);
      LayerNorm::Cache cache;
      Mat normalised(kS + kD, kB);
      Load(norm).Forward(x, cache, normalised);
      HiddenLayers("critic.body", normalised);
    }
  }
  if (!Released(setup_.switches.o2v_critic)) {
    for (int k = 0; k < kK; ++k) {
      HiddenLayers("critic.body", Stack(batch_.s, W_o.col(k).replicate(1, kB)));
    }
  }
}

/// L_o as a function of W_o: q is held constant, since the critic's o_hat is detached; so are,
/// where the switches say so, P in the value loss and the query's o_hat (`base`, W_o: the
/// unperturbed ones).
double Option2VecProblem::OptionObjective(const OptionPass& base, const Mat& W_o, const Mat& q) {
  LossTerms terms;
  const Switches& sw = setup_.switches;
  const OptionPass now = Options(Released(sw.o2v_prev_embed_grad) ? W_o : Tensor("embed.W_o"));
  const Mat& P = Released(sw.o2v_vloss_policy) ? now.P : base.P;
  Vec logp(kB), v(kB), H, scratch;
  for (Index b = 0; b < kB; ++b) {
    logp(b) = now.log_P(batch_.o[std::size_t(b)], b);
    v(b) = P.col(b).dot(q.col(b));
  }
  ClippedSurrogate(logp, batch_.option.logp_old, batch_.option.adv_hat, kClip, terms, scratch);
  ValueLoss(v, batch_.option.ret, terms, scratch);
  CategoricalEntropy(now.log_P, now.P, H);
  terms.entropy = H.mean();
  return terms.surrogate - kEntropyWeight * terms.entropy + terms.value;
}

/// Which tensors a stage must leave alone. High (option stage): the action policy and the LayerNorm
/// that nobody uses; the key bias only shifts the attention's logits. Low (action stage):
/// everything but action policy and critic, W_o above all, since o_hat is detached.
Expect Option2VecProblem::Expected(int stage, const std::string& name) const {
  const bool action = name.starts_with("action."), critic = name.starts_with("critic.");
  if (stage == 1) return action || critic ? Expect::kGradient : Expect::kDetached;
  if (action || name.starts_with("unused.")) return Expect::kDetached;
  return name == "attention.in.bk" ? Expect::kShift : Expect::kGradient;
}

/// With `o2v_vloss_policy` = paper the value loss holds P constant, so that no tensor of the option
/// policy moves it.
std::function<double()> Option2VecProblem::LossOf(int stage, const std::string& name,
                                                  const Batch& batch, const FixedDraws& fixed) {
  if (name == "embed.W_o") return option_objective_;
  const bool detached =
      stage == 0 && !name.starts_with("critic.") && !Released(setup_.switches.o2v_vloss_policy);
  return [this, stage, detached, &batch, &fixed] {
    const LossTerms terms = algo_->Loss(stage, batch, &fixed);
    return detached ? terms.total - terms.value : terms.total;
  };
}

bool Option2VecProblem::IsOutput(int stage, const std::string& name, const Batch& sample) const {
  if (name == "critic.q.b") return true;
  if (stage == 1) return name == "action.mu.b" || name == "action.sigma.b";
  return name == (sample.init[0] ? "init.1.b" : "logits.b");
}

void Option2VecProblem::Sample(int b, Batch& sample, FixedDraws& fixed) const {
  Problem::Sample(b, sample, fixed);
  fixed.o = {fixed_.o[std::size_t(b)]};
  for (const Mat& keep : fixed_.dropout) {
    Mat& column = fixed.dropout.emplace_back(keep.rows(), keep.cols() / kB);
    for (Index token = 0; token < column.cols(); ++token) {
      column.col(token) = keep.col(token * kB + b);
    }
  }
}

}  // namespace

void AddOption2VecChecks(std::vector<NamedCheck>& checks) {
  AddChecks(
      "option2vec",
      [](const Setup& setup, std::uint64_t seed) -> std::unique_ptr<Problem> {
        return std::make_unique<Option2VecProblem>(setup, seed);
      },
      {{"heads=2", [](Setup& setup) { setup.heads = 2; }},
       {"heads=3", [](Setup& setup) { setup.heads = 3; }}},
      checks);
}

}  // namespace o2v
