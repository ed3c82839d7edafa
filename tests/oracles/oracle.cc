#include "oracles/oracle.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "base/check.h"
#include "base/files.h"
#include "nn/adam.h"
#include "rollout/gae.h"

namespace o2v {
namespace {

using nlohmann::json;

std::string Entry(const std::string& array, Index row, Index col) {
  return Concat(array, "[", row, ",", col, "]");
}

const OracleMethod& FindMethod(const std::string& id) {
  static const std::vector<OracleMethod> methods = [] {
    std::vector<OracleMethod> all = {PpoOracle(), Option2VecOracle()};
    for (const OracleMethod& method : OptionMethodOracles()) all.push_back(method);
    return all;
  }();
  const auto found = std::find_if(methods.begin(), methods.end(),
                                  [&](const OracleMethod& method) { return method.id == id; });
  Check(found != methods.end(), "method '", id, "' exists, but not its comparison");
  return *found;
}

/// Settings under the program's names.
std::unique_ptr<Algorithm> Make(const json& file, const OracleMethod& method, double clip_norm,
                                Switches& switches, const json& overrides = {}) {
  const json& sizes = file.at("sizes");
  const json& given = file.at("hyper");
  Settings hyper;
  const auto set = [&](const std::string& key, double value) { hyper.Set(key, value, "oracle"); };
  set("gamma", given.at("gamma"));
  set("lambda", given.at("lam"));
  set("ratio_clip", given.at("clip"));
  set("learning_rate", given.at("lr"));
  set("adam_beta1", given.at("beta1"));
  set("adam_beta2", given.at("beta2"));
  set("adam_eps", given.at("adam_eps"));
  set("clip_norm", clip_norm);
  set("hidden", sizes.at("h"));
  set("minibatch", 1);  // the batch is given
  set("rollout", 2);    // likewise; advantages need two samples
  set("epochs", 1);
  switches = SwitchesFor(ParseFidelity(file.at("fidelity")));
  if (file.at("switches").contains("adv_std_eps")) {
    switches.adv_std_eps = file.at("switches").at("adv_std_eps");
  }
  method.settings(file, hyper, switches);
  for (const auto& [name, value] : overrides.items()) {
    Check(name == "ppoc_master_weight" && value == 1, "variant: unknown switch ", name);
    switches.ppoc_master_weight = Fidelity::kReleased;
  }
  AlgorithmInput input;
  input.S = sizes.at("S");
  input.A = sizes.at("A");
  input.hyper = &hyper;
  input.switches = switches;
  input.workers = sizes.value("N", 1);
  return MakeAlgorithm(method.id, input);
}

/// Pairs every parameter with the array of its name, in the order of Params().
template <typename Use>
void ForEachParam(Algorithm& algorithm, const json& arrays, Use&& use) {
  const std::vector<Param*> params = algorithm.Params();
  Check(arrays.size() == params.size(), "the file has ", arrays.size(), " parameters, not ",
        params.size());
  for (Param* p : params) {
    const auto found = std::find_if(arrays.begin(), arrays.end(),
                                    [&](const json& a) { return a.at("name") == p->name; });
    Check(found != arrays.end(), "the file has no parameter ", p->name);
    use(*p, *found);
  }
}

/// Loads matrices by their names in a walk over a method's state; the rest stays.
class MatrixLoader final : public StateVisitor {
 public:
  using StateVisitor::Doubles;
  using StateVisitor::Ints;
  explicit MatrixLoader(const json& arrays, std::string prefix)
      : arrays_(arrays), prefix_(std::move(prefix)) {}
  void Matrix(std::string_view name, Mat& x) override {
    for (const json& array : arrays_) {
      if (name != prefix_ + array.at("name").get<std::string>()) continue;
      x = OracleArray(array).cast<Real>();
      ++loaded_;
    }
  }
  void Doubles(std::string_view, double*, std::size_t) override {}
  void Ints(std::string_view, std::int64_t*, std::size_t) override {}
  std::size_t loaded() const { return loaded_; }

 private:
  const json& arrays_;
  std::string prefix_;
  std::size_t loaded_ = 0;
};

void LoadTarget(Algorithm& algorithm, const json& arrays) {
  MatrixLoader loader(arrays, "target.");
  algorithm.Serialize(loader);
  Check(loader.loaded() == arrays.size(), "target_params: ", loader.loaded(), " of ", arrays.size(),
        " arrays are parameters of the target network");
}

void Load(Algorithm& algorithm, const json& arrays) {
  ForEachParam(algorithm, arrays, [](Param& p, const json& array) {
    const MatD value = OracleArray(array);
    Check(value.rows() == p.value.rows() && value.cols() == p.value.cols(), p.name, " is (",
          value.rows(), ", ", value.cols(), "), not (", p.value.rows(), ", ", p.value.cols(), ")");
    p.value = value.cast<Real>();
  });
  ZeroGrad(algorithm.Params());
}

/// OC and IOPG compute their targets in the loss: no advantages and targets are given.
bool OwnTargets(const json& file) {
  const std::string method = file.at("method");
  return method == "oc" || method == "iopg";
}

/// StageTargets arrays named with `suffix`; the normalisation of the given advantages is compared.
void ReadStream(const json& batch, const std::string& suffix, double adv_std_eps,
                StageTargets& stream, Comparison& out) {
  stream.ret = OracleArray(batch.at("ret" + suffix)).cast<Real>();
  stream.adv_hat = OracleArray(batch.at("adv_hat" + suffix)).cast<Real>();
  Vec adv_hat;
  NormalizeAdvantages(OracleArray(batch.at("adv" + suffix)), adv_std_eps, adv_hat);
  out.Array("batch.adv_hat" + suffix, adv_hat.cast<double>(), batch.at("adv_hat" + suffix));
}

Batch ReadBatch(const json& file, const OracleMethod& method, const Algorithm& algorithm,
                const Switches& switches, Comparison& out) {
  const json& given = file.at("batch");
  Batch batch;
  batch.s = OracleArray(given.at("s")).transpose().cast<Real>();
  batch.a = OracleArray(given.at("a")).transpose().cast<Real>();
  const std::size_t B = static_cast<std::size_t>(batch.Size());
  batch.o.assign(B, 0);
  batch.o_prev.assign(B, 0);
  batch.init = OracleFlags(given.at("init"), batch.Size());
  if (algorithm.StageNames().size() == 2) {
    ReadStream(given, "_high", switches.adv_std_eps, batch.option, out);
    ReadStream(given, "_low", switches.adv_std_eps, batch.action, out);
  } else if (!OwnTargets(file)) {
    ReadStream(given, "", switches.adv_std_eps, batch.action, out);
  }
  method.batch(file, batch);
  return batch;
}

void CompareLosses(const json& file, const OracleMethod& method, Algorithm& algorithm,
                   const Batch& batch, Comparison& out) {
  const std::vector<std::string> stages = algorithm.StageNames();
  for (std::size_t i = 0; i < stages.size(); ++i) {
    const std::string place = "losses." + stages[i] + ".";
    const json& losses = file.at("losses").at(stages[i]);
    const FixedDraws draws = method.draws(file, stages[i], 0);
    const LossTerms terms = algorithm.Loss(static_cast<int>(i), batch, &draws);
    const std::pair<const char*, double> ours[] = {{"total", terms.total},
                                                   {"surrogate", terms.surrogate},
                                                   {"policy", terms.surrogate},
                                                   {"value", terms.value},
                                                   {"entropy", terms.entropy},
                                                   {"master", terms.master},
                                                   {"termination", terms.termination}};
    Check(losses.contains("total") && losses.contains("value"), place, ": total or value missing");
    for (const auto& [term, value] : ours) {
      if (losses.contains(term)) out.Number(place + term, value, losses.at(term));
    }
    ForEachParam(algorithm, file.at("grads").at(stages[i]), [&](const Param& p, const json& grad) {
      out.Array("grads." + stages[i] + "." + p.name, p.grad.cast<double>(), grad);
    });
    ZeroGrad(algorithm.Params());
  }
}

/// Consecutive updates in the order of the trace. `key`: "adam" or another of its form.
void CompareUpdates(const json& file, const OracleMethod& method, const std::string& key,
                    Algorithm& algorithm, const Batch& batch, double clip_norm, Comparison& out) {
  const json& updates = file.at(key);
  const json& trace = updates.at("trace");
  const std::vector<std::string> stages = algorithm.StageNames();
  const std::vector<Param*> params = algorithm.Params();
  std::vector<std::size_t> taken(stages.size(), 0);
  std::set<std::string> without;  // tensors that no loss has involved yet
  for (const Param* p : params) without.insert(p->name);
  for (std::size_t u = 0; u < trace.at("stage").size(); ++u) {
    const std::string name = trace.at("stage").at(u);
    const auto found = std::find(stages.begin(), stages.end(), name);
    Check(found != stages.end(), key, ".trace.stage[", u, "]: no stage '", name, "'");
    const auto stage = static_cast<std::size_t>(found - stages.begin());
    const FixedDraws draws = method.draws(file, name, taken[stage]++);
    const double total = algorithm.Loss(static_cast<int>(stage), batch, &draws).total;
    const std::vector<char> in_graph = algorithm.InGraph(static_cast<int>(stage));
    const double norm = algorithm.Step(static_cast<int>(stage));
    const std::string place = Concat(key, ".trace[", u, "].");
    out.Number(place + "total", total, trace.at("total").at(u));
    out.Number(place + "grad_norm", norm, trace.at("grad_norm").at(u));
    out.Number(place + "clip_factor", ClipFactor(norm, clip_norm), trace.at("clip_factor").at(u));

    std::set<std::string> outside;
    for (std::size_t i = 0; i < params.size(); ++i) {
      if (in_graph[i]) without.erase(params[i]->name);
      if (!in_graph[i]) outside.insert(params[i]->name);
    }
    for (const auto& [list, ours] :
         {std::pair("not_in_graph", &outside), std::pair("never_had_gradient", &without)}) {
      if (!updates.contains(list) || taken[stage] != updates.at("updates_per_stage")) continue;
      const json& theirs = updates.at(list).at(name);
      Check(*ours == std::set<std::string>(theirs.begin(), theirs.end()), key, ".", list, ".", name,
            ": ", ours->size(), " tensors of ours are not the ", theirs.size(), " of the file");
    }
  }
  ForEachParam(algorithm, updates.at("params"), [&](const Param& p, const json& value) {
    out.UpdatedParam(key + ".params." + p.name, p.value.cast<double>(), value);
  });
}

void CompareGae(const json& gae, Comparison& out) {
  const MatD r = OracleArray(gae.at("r")).transpose(),
             mask = OracleArray(gae.at("mask")).transpose();
  for (const std::string stream : {"v1", "v2"}) {
    const json& given = gae.at(stream);
    MatD adv, ret;
    Gae(r, mask, OracleArray(given.at("v")).transpose(), gae.at("gamma"), gae.at("lam"), adv, ret);
    out.Array("gae." + stream + ".adv", adv.transpose(), given.at("adv"));
    out.Array("gae." + stream + ".ret", ret.transpose(), given.at("ret"));
    for (const auto& [fidelity, eps] : {std::pair("released", 0.0), std::pair("paper", 1e-8)}) {
      Vec adv_hat;
      NormalizeAdvantages(adv, eps, adv_hat);
      const MatD shaped = adv_hat.cast<double>().reshaped(adv.rows(), adv.cols());
      const std::string name = std::string("adv_hat_") + fidelity;
      out.Array("gae." + stream + "." + name, shaped.transpose(), given.at(name));
    }
  }
}

}  // namespace

void Comparison::Add(double deviation, double bound, const std::string& where) {
  ++count_;
  const double before = deviation_ / bound_;
  if (std::isnan(before) || !(deviation / bound > before || std::isnan(deviation))) return;
  deviation_ = deviation;
  bound_ = bound;
  where_ = where;
}

void Comparison::Number(const std::string& where, double ours, double theirs) {
  Add(std::abs(ours - theirs) / std::max(1.0, std::abs(theirs)), kOracleBound, where);
}

void Comparison::Array(const std::string& where, const MatD& ours, const json& theirs) {
  const MatD reference = OracleArray(theirs);
  Check(ours.rows() == reference.rows() && ours.cols() == reference.cols(), where, ": ours is (",
        ours.rows(), ", ", ours.cols(), "), the file's (", reference.rows(), ", ", reference.cols(),
        ")");
  for (Index i = 0; i < ours.rows(); ++i) {
    for (Index j = 0; j < ours.cols(); ++j) {
      Number(Entry(where, i, j), ours(i, j), reference(i, j));
    }
  }
}

void Comparison::UpdatedParam(const std::string& where, const MatD& ours, const json& theirs) {
  const MatD reference = OracleArray(theirs);
  for (Index i = 0; i < ours.rows(); ++i) {
    for (Index j = 0; j < ours.cols(); ++j) {
      Add(std::abs(ours(i, j) - reference(i, j)), kOracleParamBound, Entry(where, i, j));
    }
  }
}

MatD OracleArray(const json& array) {
  const Index rows = array.at("shape").at(0), cols = array.at("shape").at(1);
  const auto data = array.at("data").get<std::vector<double>>();
  Check(rows >= 0 && cols >= 0 && data.size() == std::size_t(rows) * std::size_t(cols),
        "an array of shape (", rows, ", ", cols, ") holds ", data.size(), " numbers");
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(data.data(), rows, cols);
}

std::vector<int> OracleInts(const json& array, Index n, int below) {
  const MatD numbers = OracleArray(array);
  std::vector<int> out;
  for (const double x : numbers.reshaped()) {
    Check(x >= 0 && x < below && x == std::floor(x), "got ", x, ", not a whole number below ",
          below);
    out.push_back(static_cast<int>(x));
  }
  Check(Index(out.size()) == n, "got ", out.size(), " whole numbers, not ", n);
  return out;
}

std::vector<char> OracleFlags(const json& array, Index n) {
  const std::vector<int> flags = OracleInts(array, n, 2);
  return {flags.begin(), flags.end()};
}

json ReadOracle(const std::filesystem::path& path) {
  try {
    return json::parse(ReadFile(path));
  } catch (const json::exception& error) {
    throw Error(error.what());
  }
}

std::string OracleFileMethod(const json& file) {
  Check(file.is_object() && file.value("format", "") == "option2vec-oracle-1",
        "not a file of format 'option2vec-oracle-1'");
  return file.at("method");
}

Comparison CompareOracle(const json& file) {
  try {
    const OracleMethod& method = FindMethod(OracleFileMethod(file));
    Comparison out;
    Switches switches;
    const double clip_norm = file.at("hyper").at("clip_norm");
    const std::unique_ptr<Algorithm> algorithm = Make(file, method, clip_norm, switches);
    Load(*algorithm, file.at("params"));
    if (file.contains("target_params")) LoadTarget(*algorithm, file.at("target_params"));
    const Batch batch = ReadBatch(file, method, *algorithm, switches, out);
    method.forward(file, *algorithm, batch, out);
    CompareLosses(file, method, *algorithm, batch, out);
    CompareUpdates(file, method, "adam", *algorithm, batch, clip_norm, out);
    if (file.contains("adam_large_clip")) {
      const double large = file.at("adam_large_clip").at("clip_norm");
      const std::unique_ptr<Algorithm> unclipped = Make(file, method, large, switches);
      Load(*unclipped, file.at("params"));
      CompareUpdates(file, method, "adam_large_clip", *unclipped, batch, large, out);
    }
    if (file.contains("variants")) {
      for (const json& variant : file.at("variants")) {
        const std::unique_ptr<Algorithm> other =
            Make(file, method, clip_norm, switches, variant.at("switches"));
        Load(*other, file.at("params"));
        CompareLosses(variant, method, *other, batch, out);
      }
    }
    if (!OwnTargets(file)) CompareGae(file.at("gae"), out);
    return out;
  } catch (const json::exception& error) {
    throw Error(error.what());
  }
}

}  // namespace o2v
