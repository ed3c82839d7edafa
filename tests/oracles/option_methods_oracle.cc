// The six methods with one network an option.

#include "base/check.h"
#include "dist/diag_gaussian.h"
#include "oracles/oracle.h"

namespace o2v {
namespace {

using nlohmann::json;

void ReadCommon(const json& file, Settings& hyper) {
  const std::string activation = file.at("activation");
  Check(activation == "tanh" || activation == "relu", "unknown activation '", activation, "'");
  hyper.Set("activation", activation == "relu", "oracle");
  hyper.Set("options", file.at("sizes").at("K"), "oracle");
}

void ReadNumber(const json& file, const char* theirs, const char* ours, Settings& hyper) {
  hyper.Set(ours, file.at("hyper").at(theirs), "oracle");
}

void DacSettings(const json& file, Settings& hyper, Switches&) {
  ReadCommon(file, hyper);
  ReadNumber(file, "w_entropy", "entropy_weight", hyper);
  hyper.Set("ynet_hidden", file.at("sizes").value("h_y", 64), "oracle");  // spec 2.4
}

void PpocSettings(const json& file, Settings& hyper, Switches&) {
  ReadCommon(file, hyper);
  ReadNumber(file, "w_entropy", "entropy_weight", hyper);
  ReadNumber(file, "eta", "termination_penalty", hyper);
}

void OcSettings(const json& file, Settings& hyper, Switches& switches) {
  PpocSettings(file, hyper, switches);
  ReadNumber(file, "eps_greedy", "epsilon_greedy", hyper);
  hyper.Set("target_every", 1000, "oracle");  // the target network is given
}

void PlainSettings(const json& file, Settings& hyper, Switches&) { ReadCommon(file, hyper); }

void ReadOptions(const json& file, Batch& batch) {
  const json& given = file.at("batch");
  const int K = file.at("sizes").at("K");
  batch.o = OracleInts(given.at("o"), batch.Size(), K);
  if (given.contains("o_prev")) batch.o_prev = OracleInts(given.at("o_prev"), batch.Size(), K);
}

void DacBatch(const json& file, Batch& batch) {
  const json& given = file.at("batch");
  ReadOptions(file, batch);
  for (const char* name : {"pi_hat_old", "P_old", "p_old"}) {
    if (given.contains(name)) batch.P_old = OracleArray(given.at(name)).transpose().cast<Real>();
  }
  Check(batch.P_old.cols() == batch.Size(), "no old option probabilities");
  batch.option.logp_old = OracleArray(given.at("logp_high_old")).cast<Real>();
  batch.action.logp_old = OracleArray(given.at("logp_low_old")).cast<Real>();
}

void SingleStreamBatch(const json& file, Batch& batch) {
  const json& given = file.at("batch");
  ReadOptions(file, batch);
  batch.action.logp_old = OracleArray(given.at("logp_old")).cast<Real>();
  if (given.contains("stop")) batch.stop = OracleFlags(given.at("stop"), batch.Size());
}

/// Rewards and ends, for methods that compute targets in the loss.
void RewardBatch(const json& file, Batch& batch) {
  const json& given = file.at("batch");
  ReadOptions(file, batch);
  batch.r = OracleArray(given.at("r"));
  batch.mask = OracleArray(given.at("mask"));
  if (given.contains("s_T")) batch.s_end = OracleArray(given.at("s_T")).transpose().cast<Real>();
}

FixedDraws NoDraws(const json&, const std::string&, std::size_t) { return {}; }

/// Gaussians of all options, log-densities of those executed, option values.
void Forward(const json& file, Algorithm& algorithm, const Batch& batch, Comparison& out) {
  const json& forward = file.at("forward");
  const Index B = batch.Size(), A = batch.a.rows(), K = algorithm.NumOptions();
  const MatD mu_all = OracleArray(forward.at("mu")).transpose(),
             sigma_all = OracleArray(forward.at("sigma")).transpose();
  Mat mu, sigma, q, P;
  for (Index k = 0; k < K; ++k) {
    algorithm.ActionPolicy(batch.s, std::vector<int>(std::size_t(B), int(k)), mu, sigma);
    for (Index b = 0; b < B; ++b) {
      for (Index j = 0; j < A; ++j) {
        out.Number(Concat("forward.mu[", b, ",", k * A + j, "]"), mu(j, b), mu_all(k * A + j, b));
        out.Number(Concat("forward.sigma[", k, ",", j, "]"), sigma(j, b), sigma_all(j, k));
      }
    }
  }
  if (forward.contains("logp")) {
    Vec logp;
    algorithm.ActionPolicy(batch.s, batch.o, mu, sigma);
    GaussianLogProb(batch.a, mu, sigma, logp);
    out.Array("forward.logp", logp.cast<double>(), forward.at("logp"));
  }

  // AHP's critic is u, of which the query shows the entries after an option.
  algorithm.OptionValues(batch.s, batch.o, q);
  const bool u = file.at("method") == "ahp_ppo";
  const MatD values = OracleArray(forward.at(u ? "u" : "q")).leftCols(K);
  for (Index b = 0; b < B; ++b) {
    for (Index k = 0; k < K; ++k) {
      out.Number(Concat("forward.q[", b, ",", k, "]"), q(k, b), values(b, k));
    }
  }

  // What options are drawn from, normalised.
  const std::vector<int>& o_prev = batch.o_prev;
  algorithm.OptionPolicy(batch.s, o_prev, batch.init, P);
  MatD expected;
  for (const char* name : {"pi_hat", "P", "p", "option_probs"}) {
    if (forward.contains(name)) expected = OracleArray(forward.at(name));
  }
  if (expected.size() == 0) {  // AHP, IOPG: from master policy and terminations
    const MatD pi = OracleArray(forward.at("pi")), beta = OracleArray(forward.at("beta"));
    const bool always = file.at("method") == "iopg" && file.at("fidelity") == "released";
    expected = pi;
    for (Index b = 0; b < B; ++b) {
      const std::size_t i = std::size_t(b);
      if (batch.init[i] || always) continue;
      expected.row(b) *= beta(b, o_prev[i]);
      expected(b, o_prev[i]) += 1 - beta(b, o_prev[i]);
    }
  }
  for (Index b = 0; b < B; ++b) {
    const double sum = expected.row(b).sum();
    for (Index k = 0; k < K; ++k) {
      out.Number(Concat("forward.P[", b, ",", k, "]"), P(k, b), expected(b, k) / sum);
    }
  }
}

}  // namespace

std::vector<OracleMethod> OptionMethodOracles() {
  return {{"dac_onestep", DacSettings, DacBatch, NoDraws, Forward},
          {"dac_ppo", DacSettings, DacBatch, NoDraws, Forward},
          {"ahp_ppo", PlainSettings, SingleStreamBatch, NoDraws, Forward},
          {"iopg", PlainSettings, RewardBatch, NoDraws, Forward},
          {"ppoc", PpocSettings, SingleStreamBatch, NoDraws, Forward},
          {"oc", OcSettings, RewardBatch, NoDraws, Forward}};
}

}  // namespace o2v
