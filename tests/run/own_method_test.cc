// A method and a task of somebody else's, through the whole program: what docs/extending.md says is
// all that they need. The method is PPO with one trunk for actor and critic.

#include <gtest/gtest.h>

#include <sstream>

#include "algo/ppo_method.h"
#include "algo/setup.h"
#include "algo/toy.h"
#include "dist/diag_gaussian.h"
#include "run/record.h"
#include "run/trainer.h"
#include "test_folder.h"

namespace o2v {
namespace {

/// mu(s) = W_mu f(s), v(s) = W_v f(s), sigma = softplus(rho).
class SharedTrunk final : public PpoMethod {
 public:
  explicit SharedTrunk(const AlgorithmInput& in)
      : PpoMethod(in, /*K=*/0),
        trunk_("trunk", in.S, in.hyper->Int("hidden", 1), ReadActivation(*in.hyper), initialiser_),
        mu_("mu", in.hyper->Int("hidden", 1), in.A),
        v_("v", in.hyper->Int("hidden", 1), 1),
        rho_("rho", in.A, 1),
        clip_(in.hyper->Real("ratio_clip")),
        w_(in.hyper->Real("entropy_weight")) {
    std::vector<Param*> params = trunk_.Params();
    Append(params, mu_.Params());
    Append(params, v_.Params());
    params.push_back(&rho_);
    RegisterNetworks(in, params, {params}, nullptr, nullptr);
  }

  void OptionPolicy(const Mat& s, const std::vector<int>&, const std::vector<char>&,
                    Mat& P) override {
    P.setOnes(1, s.cols());
  }
  void ActionPolicy(const Mat& s, const std::vector<int>&, Mat& mu, Mat& sigma) override {
    Forward(s);
    mu = mu_out_;
    sigma = sigma_.replicate(1, s.cols());
  }
  void OptionValues(const Mat& s, const std::vector<int>&, Mat& q) override {
    Forward(s);
    q = v_out_;
  }

  LossTerms Loss(int, const Batch& batch, const FixedDraws*) override {
    LossTerms terms;
    Vec logp, dlogp, v, dv;
    Mat dmu, dsigma;
    Forward(batch.s);
    GaussianLogProb(batch.a, mu_out_, sigma_, logp);
    ClippedSurrogate(logp, batch.action.logp_old, batch.action.adv_hat, clip_, terms, dlogp);
    v = v_out_.row(0).transpose();
    ValueLoss(v, batch.action.ret, terms, dv);
    terms.entropy = GaussianMeanEntropy(sigma_);
    terms.total = terms.surrogate - w_ * terms.entropy + terms.value;

    GaussianLogProbGrad(batch.a, mu_out_, sigma_, dlogp, dmu, dsigma);
    AddGaussianEntropyGrad(sigma_, Real(-w_), dsigma);
    SoftplusBackward(sigma_, dsigma);
    rho_.grad += dsigma;
    const Mat& f = c_.h1;
    mu_.AddGrad(f, dmu);
    v_.AddGrad(f, dv.transpose());
    Mat df(f.rows(), f.cols()), of_v(f.rows(), f.cols());
    mu_.BackwardInput(dmu, df);
    v_.BackwardInput(dv.transpose(), of_v);
    df += of_v;
    trunk_.Backward(batch.s, c_, df);
    return terms;
  }

 private:
  void Act(const Mat& s, std::span<const char>, Index first) override {
    Vec logp;
    Forward(s);
    SampleGaussian(mu_out_, sigma_, policy_rng_, a_);
    GaussianLogProb(a_, mu_out_, sigma_, logp);
    rollout_.batch.action.logp_old.segment(first, N_) = logp;
  }
  void Values(const Choices& x, Index first) override {
    Forward(x.s);
    Eigen::Map<VecD>(rollout_.critics[0].v.data() + first, x.s.cols()) =
        v_out_.row(0).transpose().cast<double>();
  }
  void Forward(const ConstMatRef& s) {
    trunk_.Forward(s, c_);
    mu_out_.resize(mu_.W.value.rows(), s.cols());
    v_out_.resize(1, s.cols());
    mu_.Forward(c_.h1, mu_out_);
    v_.Forward(c_.h1, v_out_);
    sigma_ = rho_.value;
    Softplus(sigma_);
  }

  MlpTrunk trunk_;
  Linear mu_, v_;
  Param rho_;
  const double clip_, w_;
  MlpTrunk::Cache c_;
  Mat mu_out_, v_out_, sigma_;
};

/// As SmallConfig's PPO, with numbers that learn fast.
RunConfig FastConfig() {
  RunConfig config = SmallConfig("ppo", Fidelity::kPaper,
                                 {"hidden=32", "workers=2", "rollout=256", "minibatch=64",
                                  "epochs=5", "learning_rate=1e-3", "steps=20480"});
  config.seed = 1;
  return config;
}

TEST(OwnMethod, TrainsOnAnOwnTaskAndLeavesARecord) {
  const RunConfig config = FastConfig();
  RunParts parts;
  parts.make_env = [](int) {
    return std::make_unique<PointEnv>(/*time_limit=*/50, /*scale=*/0.05);
  };
  parts.make_algorithm = [&](const EnvSpec& spec) {
    AlgorithmInput in;
    in.S = spec.S;
    in.A = spec.A;
    in.workers = config.workers;
    in.hyper = &config.hyper;
    in.switches = config.switches;
    in.seed = config.seed;
    return std::make_unique<SharedTrunk>(in);
  };
  TestFolder dir;
  std::ostringstream progress;
  EXPECT_EQ(Train(config, parts, dir / "run", /*resume=*/false, progress, /*terminal=*/false),
            RunStatus::kDone);
  // An untrained policy leaves the point at |x| of about 0.5, so that an episode of 50 steps costs
  // about 1.25; a trained one costs what the way to 0 does, and its noise.
  const CsvTable record = ReadCsv(RecordPath(dir / "run", ".csv"));
  EXPECT_GT(record.At(record.Rows() - 1, record.Column("return_20")), -0.25);
  EXPECT_TRUE(std::filesystem::exists(dir / "run" / "last.ckpt"));
}

}  // namespace
}  // namespace o2v
