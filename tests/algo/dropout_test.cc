// Where Option2Vec's dropout acts (spec 2.6): in what is drawn, not in what is asked.

#include <gtest/gtest.h>

#include <vector>

#include "algo/option2vec_nets.h"
#include "algo/setup.h"
#include "dist/categorical.h"
#include "dist/diag_gaussian.h"
#include "nn/dropout.h"

namespace o2v {
namespace {

/// The state of a random stream of a learner, or of one by itself.
class StreamState final : public StateVisitor {
 public:
  StreamState(Algorithm& algorithm, std::string name) : name_("rng." + name) {
    algorithm.Serialize(*this);
  }
  explicit StreamState(Rng& rng) : name_("rng") { rng.Serialize(*this, name_); }
  void Matrix(std::string_view, Mat&) override {}
  void Doubles(std::string_view, double*, std::size_t) override {}
  void Ints(std::string_view name, std::int64_t* x, std::size_t n) override {
    if (name.starts_with(name_)) state.insert(state.end(), x, x + n);
  }

  std::vector<std::int64_t> state;

 private:
  const std::string name_;
};

/// The option policy of a learner with weights of order 1.
struct Dropping {
  RunConfig config = SmallConfig("option2vec", Fidelity::kReleased);
  VecEnv env = PointTask(config.workers, /*time_limit=*/5);
  std::unique_ptr<Algorithm> algorithm = MakeRunAlgorithm(config, env.Spec());
  Option2VecSizes sizes{.S = 1, .A = 1, .K = 4, .D = 6, .F = 7, .heads = 1, .h = 8, .h_start = 16};
  PolicyOverOptions net{
      sizes, {.two_tokens = true, .init_relu = true, .prev_embed_grad = false}, Initialiser()};
  PolicyOverOptions::Tables tables;
  PolicyOverOptions::Cache c;

  Dropping() {
    Rng rng(4, "weights");
    for (Param* p : algorithm->Params())
      p->value = RandomMat(p->value.rows(), p->value.cols(), rng);
    for (Param* p : net.Params()) p->value = FindParam(*algorithm, p->name).value;
    net.Tabulate(tables);
  }
};

TEST(Option2Vec, ActsThroughFreshMasksOfItsProbability) {
  Dropping on;
  VecEnv own = PointTask(on.config.workers, 5);
  Rng dropout(1, "dropout"), policy(1, "policy");
  const Index N = on.config.workers;
  const auto draw = [&] {
    AttentionBlock::Masks& masks = on.c.masks;
    masks.Resize(on.sizes.heads * on.sizes.K, on.sizes.D, on.sizes.F, 2 * N);  // two tokens
    for (Mat* mask :
         {&masks.attention, &masks.after_attention, &masks.inside_ffn, &masks.after_ffn}) {
      DrawDropoutMask(0.2, dropout, *mask);
    }
  };
  std::vector<int> o(std::size_t(N), 0);
  Transition came;
  std::vector<Episode> episodes;
  Mat mu, sigma, a;
  for (int t = 0; t < on.config.hyper.Int("rollout"); ++t) {
    draw();
    on.net.Forward(own.States(), o, own.EpisodeStarts(), on.tables, &on.c.masks, on.c);
    SampleCategorical(on.c.P, policy, o);
    on.algorithm->ActionPolicy(own.States(), o, mu, sigma);
    SampleGaussian(mu, sigma, policy, a);
    own.Step(a, came, episodes);
  }
  draw();  // for the states after the rollout; released bootstraps no time limit
  on.algorithm->Collect(on.env, episodes);
  EXPECT_LT((on.env.States() - own.States()).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_EQ(StreamState(*on.algorithm, "policy").state, StreamState(policy).state);
  EXPECT_EQ(StreamState(*on.algorithm, "dropout").state, StreamState(dropout).state);
}

TEST(Option2Vec, RedrawsOptionsThroughTheMasksOfTheUpdate) {
  Rng rng(6, "batch");
  const Index B = 40;
  for (const int stage : {0, 1}) {
    Dropping on;
    const Batch batch = RandomBatch(1, 1, 4, B, rng);
    Rng dropout(1, "dropout"), redraw(1, "redraw");
    AttentionBlock::Masks& masks = on.c.masks;
    masks.Resize(on.sizes.heads * on.sizes.K, on.sizes.D, on.sizes.F, 2 * B);
    FixedDraws fixed;
    for (Mat* mask :
         {&masks.attention, &masks.after_attention, &masks.inside_ffn, &masks.after_ffn}) {
      DrawDropoutMask(0.2, dropout, *mask);
      fixed.dropout.emplace_back((mask->array() > 0).cast<Real>());
    }
    on.net.Forward(batch.s, batch.o_prev, batch.init, on.tables, &masks, on.c);
    fixed.o.resize(std::size_t(B));
    SampleCategorical(on.c.P, redraw, fixed.o);
    const LossTerms drawn = on.algorithm->Loss(stage, batch, nullptr);
    const LossTerms given = on.algorithm->Loss(stage, batch, &fixed);
    EXPECT_NEAR(drawn.value, given.value, 1e-5) << stage;
    EXPECT_NEAR(drawn.surrogate, given.surrogate, 1e-5) << stage;
    EXPECT_EQ(StreamState(*on.algorithm, "dropout").state, StreamState(dropout).state) << stage;
    EXPECT_EQ(StreamState(*on.algorithm, "redraw").state, StreamState(redraw).state) << stage;
  }
}

TEST(Option2Vec, IsAskedWithoutDropout) {
  Dropping on;
  Rng rng(5, "states");
  const Mat s = RandomMat(1, 30, rng);
  const std::vector<int> o_prev = RandomOptions(30, 4, rng);
  std::vector<char> init(30, 0);
  init[3] = init[8] = 1;
  on.net.Forward(s, o_prev, init, on.tables, nullptr, on.c);
  Mat P;
  on.algorithm->OptionPolicy(s, o_prev, init, P);
  EXPECT_LT((P - on.c.P).cwiseAbs().maxCoeff(), 1e-6);
  Rng untouched(1, "dropout");
  EXPECT_EQ(StreamState(*on.algorithm, "dropout").state, StreamState(untouched).state);
}

}  // namespace
}  // namespace o2v
