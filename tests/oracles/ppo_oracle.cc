#include "base/check.h"
#include "dist/diag_gaussian.h"
#include "oracles/oracle.h"

namespace o2v {
namespace {

using nlohmann::json;

void ReadSettings(const json& file, Settings& hyper, Switches&) {
  const std::string activation = file.at("activation");
  Check(activation == "tanh" || activation == "relu", "unknown activation '", activation, "'");
  hyper.Set("activation", activation == "relu", "oracle");
  hyper.Set("entropy_weight", file.at("hyper").at("w_entropy"), "oracle");
}

void ReadBatch(const json& file, Batch& batch) {
  batch.action.logp_old = OracleArray(file.at("batch").at("logp_old")).cast<Real>();
}

FixedDraws NoDraws(const json&, const std::string&, std::size_t) { return {}; }

void Forward(const json& file, Algorithm& ppo, const Batch& batch, Comparison& out) {
  const json& forward = file.at("forward");
  Mat mu, sigma, v;
  Vec logp;
  ppo.ActionPolicy(batch.s, batch.o, mu, sigma);
  ppo.OptionValues(batch.s, batch.o, v);
  GaussianLogProb(batch.a, mu, sigma, logp);
  out.Array("forward.mu", mu.transpose().cast<double>(), forward.at("mu"));
  out.Array("forward.sigma", sigma.col(0).cast<double>(), forward.at("sigma"));
  out.Array("forward.v", v.transpose().cast<double>(), forward.at("v"));
  out.Array("forward.logp", logp.cast<double>(), forward.at("logp"));
  out.Array("forward.ratio", (logp - batch.action.logp_old).array().exp().matrix().cast<double>(),
            forward.at("ratio"));
}

}  // namespace

OracleMethod PpoOracle() { return {"ppo", ReadSettings, ReadBatch, NoDraws, Forward}; }

}  // namespace o2v
