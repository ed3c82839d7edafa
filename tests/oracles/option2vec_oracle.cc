#include <cmath>

#include "base/check.h"
#include "dist/categorical.h"
#include "dist/diag_gaussian.h"
#include "oracles/oracle.h"

namespace o2v {
namespace {

using nlohmann::json;

bool Released(const json& file) { return file.at("fidelity") == "released"; }

void ReadSettings(const json& file, Settings& hyper, Switches& switches) {
  const json& sizes = file.at("sizes");
  const json& given = file.at("hyper");
  Check(given.at("layers") == 1, "got ", given.at("layers"), " attention layers, not 1");
  const auto set = [&](const char* key, const json& value) { hyper.Set(key, value, "oracle"); };
  set("options", sizes.at("K"));
  set("embedding", sizes.at("D"));
  set("ffn", sizes.at("F"));
  set("init_hidden", sizes.at("h_init"));
  set("heads", given.at("heads"));
  set("entropy_weight_option", given.at("w_entropy_option"));
  set("entropy_weight_action", given.at("w_entropy_action"));
  switches.o2v_dropout = file.at("switches").at("o2v_dropout");
}

void ReadBatch(const json& file, Batch& batch) {
  const json& given = file.at("batch");
  const int K = file.at("sizes").at("K");
  batch.o = OracleInts(given.at("o"), batch.Size(), K);
  batch.o_prev = OracleInts(given.at("o_prev"), batch.Size(), K);
  if (Released(file)) batch.init = OracleFlags(given.at("flag_update"), batch.Size());
  const MatD log_P_old = OracleArray(given.at("log_P_old"));
  batch.option.logp_old.resize(batch.Size());
  for (Index b = 0; b < batch.Size(); ++b) {
    batch.option.logp_old(b) = static_cast<Real>(log_P_old(b, batch.o[std::size_t(b)]));
  }
  batch.action.logp_old = OracleArray(given.at("logp_low_old")).cast<Real>();
}

/// The file has a sample's two tokens side by side, the network has them in two blocks of columns.
std::vector<Mat> ReadMasks(const json& masks) {
  std::vector<Mat> out;
  for (const char* place : {"attention", "after_attention", "inside_ffn", "after_ffn"}) {
    const Mat given = OracleArray(masks.at(place)).transpose().cast<Real>();
    const Index n = given.rows() / 2, B = given.cols();
    Mat& mask = out.emplace_back(n, 2 * B);
    mask << given.topRows(n), given.bottomRows(n);
  }
  return out;
}

FixedDraws Draws(const json& file, const std::string& stage, std::size_t u) {
  FixedDraws draws;
  if (const std::string key = "o_drawn_" + stage; Released(file)) {
    const Index B = file.at("sizes").at("B");
    const int K = file.at("sizes").at("K");
    const json& drawn = file.at("batch").at(key);
    const Index updates = drawn.at("shape").at(1);
    Check(Index(u) < updates, key, " has ", updates, " updates, not ", u + 1);
    const std::vector<int> all = OracleInts(drawn, B * updates, K);  // update after update
    draws.o.assign(all.begin() + Index(u) * B, all.begin() + (Index(u) + 1) * B);
  }
  if (file.contains("dropout_masks")) {
    draws.dropout = ReadMasks(file.at("dropout_masks").at(stage).at(u));
  }
  return draws;
}

/// P (K, B) and V_bar (B) of a pass with given masks, read out of the loss of one sample: with old
/// log-probability 0 and advantage 1 the surrogate is -P_o, as P_o <= 1; with target R below V_bar
/// the value term is (V_bar - R)^2 / 2.
void MaskedPass(Algorithm& option2vec, const Batch& batch, const FixedDraws& draws, Index K,
                MatD& P, MatD& V_bar) {
  const double R = -100;
  const Index B = batch.Size();
  P.resize(K, B);
  V_bar.resize(B, 1);
  for (Index b = 0; b < B; ++b) {
    const auto row = std::size_t(b);
    Batch one;
    one.Resize(batch.s.rows(), batch.a.rows(), 1);
    one.s = batch.s.col(b);
    one.o_prev = {batch.o_prev[row]};
    one.init = {batch.init[row]};
    one.option.logp_old(0) = 0;
    one.option.adv_hat(0) = 1;
    one.option.ret(0) = R;
    FixedDraws mine;
    mine.o = {draws.o[row]};
    for (const Mat& mask : draws.dropout) {
      Mat& column = mine.dropout.emplace_back(mask.rows(), 2);
      column << mask.col(b), mask.col(B + b);
    }
    for (Index k = 0; k < K; ++k) {
      one.o = {int(k)};
      const LossTerms terms = option2vec.Loss(0, one, &mine);
      P(k, b) = -terms.surrogate;
      V_bar(b) = std::sqrt(2 * terms.value) + R;
    }
  }
  ZeroGrad(option2vec.Params());
}

/// One part of `forward`: `batch.init` the flag and `o` the option that the pass is fed.
void ForwardPart(const json& part, const std::string& place, Algorithm& option2vec,
                 const Batch& batch, const FixedDraws& draws, const std::vector<int>& o,
                 Comparison& out) {
  const Index B = batch.Size();
  Mat mu, sigma, q, P, expected_P, log_P;
  option2vec.ActionPolicy(batch.s, o, mu, sigma);
  option2vec.OptionValues(batch.s, o, q);
  out.Array(place + "mu", mu.transpose().cast<double>(), part.at("mu"));
  out.Array(place + "sigma", sigma.transpose().cast<double>(), part.at("sigma"));
  out.Array(place + "q", q.transpose().cast<double>(), part.at("q"));
  Vec q_o(B);
  for (Index b = 0; b < B; ++b) q_o(b) = q(o[std::size_t(b)], b);
  out.Array(place + "q_o", q_o.cast<double>(), part.at("q_o"));

  // Both sources of logits for all rows, also where the flag takes the other.
  const auto compare_logits = [&](const char* name, bool relu, char init) {
    if (!part.contains(name)) return;
    Mat z = OracleArray(part.at(name)).transpose().cast<Real>();
    if (relu) z = z.cwiseMax(0);
    LogSoftmax(z, log_P, expected_P);
    option2vec.OptionPolicy(batch.s, batch.o_prev, std::vector<char>(std::size_t(B), init), P);
    for (Index b = 0; b < B; ++b) {
      for (Index k = 0; k < P.rows(); ++k) {
        out.Number(Concat(place, "softmax(", name, ")[", b, ",", k, "]"), P(k, b),
                   expected_P(k, b));
      }
    }
  };
  compare_logits("z_init", false, 1);
  compare_logits("z_init_pre", true, 1);  // released: a ReLU on the initial logits

  MatD probabilities, V_bar(B, 1);
  if (draws.dropout.empty()) {
    compare_logits("z_attention", false, 0);
    option2vec.OptionPolicy(batch.s, batch.o_prev, batch.init, P);
    probabilities = P.cast<double>();
    for (Index b = 0; b < B; ++b) V_bar(b) = double(P.col(b).dot(q.col(b)));
  } else {
    MaskedPass(option2vec, batch, draws, q.rows(), probabilities, V_bar);
  }
  out.Array(place + "P", probabilities.transpose(), part.at("P"));
  out.Array(place + "log_P", probabilities.transpose().array().log(), part.at("log_P"));
  out.Array(place + "V_bar", V_bar, part.at("V_bar"));

  if (part.contains("ratio_high")) {
    MatD ratio(B, 1);
    for (Index b = 0; b < B; ++b) {
      ratio(b) =
          probabilities(batch.o[std::size_t(b)], b) / std::exp(double(batch.option.logp_old(b)));
    }
    out.Array(place + "ratio_high", ratio, part.at("ratio_high"));
  }
  if (part.contains("ratio_low")) {
    Vec logp;
    GaussianLogProb(batch.a, mu, sigma, logp);
    out.Array(place + "logp_low", logp.cast<double>(), part.at("logp_low"));
    out.Array(place + "ratio_low",
              (logp - batch.action.logp_old).array().exp().matrix().cast<double>(),
              part.at("ratio_low"));
  }
}

void Forward(const json& file, Algorithm& option2vec, const Batch& batch, Comparison& out) {
  const json& forward = file.at("forward");
  if (!Released(file)) {
    ForwardPart(forward, "forward.", option2vec, batch, {}, batch.o, out);
    return;
  }
  Batch acting = batch;
  acting.init = OracleFlags(file.at("batch").at("init"), batch.Size());
  FixedDraws draws;
  draws.o = batch.o;
  if (file.contains("dropout_masks")) {
    draws.dropout = ReadMasks(file.at("dropout_masks").at("rollout"));
  }
  ForwardPart(forward.at("rollout"), "forward.rollout.", option2vec, acting, draws, batch.o, out);
  for (const std::string stage : {"high", "low"}) {
    draws = Draws(file, stage, 0);
    ForwardPart(forward.at(stage), "forward." + stage + ".", option2vec, batch, draws, draws.o,
                out);
  }
}

}  // namespace

OracleMethod Option2VecOracle() { return {"option2vec", ReadSettings, ReadBatch, Draws, Forward}; }

}  // namespace o2v
