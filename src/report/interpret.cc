#include "report/interpret.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "base/check.h"
#include "base/csv.h"
#include "base/files.h"
#include "run/evaluate.h"
#include "run/manifest.h"
#include "run/record.h"

namespace o2v {

namespace fs = std::filesystem;

namespace {

constexpr const char* kFirstColumn = "dimension";

/// Whether InterpretationJson wrote it.
bool IsInterpretation(const std::string& json) {
  const auto in = nlohmann::json::parse(json, nullptr, /*allow_exceptions=*/false);
  return in.is_object() && in.contains("commit") && in.contains("episodes") &&
         in.contains("states");
}

}  // namespace

Interpretation Interpret(Policy& policy, const Normalizer& normalizer, Env& env, int episodes,
                         double delta, std::uint64_t seed) {
  Param* const embedding = policy.Embedding();
  Check(embedding != nullptr, "interpret: the method's options have no embedding");
  Check(delta > 0 && std::isfinite(delta), "interpret: delta is ", delta, ", not positive");

  std::vector<Real> visited;  // states, one after the other
  std::vector<int> o;
  Evaluate(policy, normalizer, env, episodes, /*sample_action=*/true, seed,
           [&](const EvalStep& step) {
             visited.insert(visited.end(), step.s.data(), step.s.data() + step.s.size());
             o.push_back(step.o);
           });
  const Mat s = Eigen::Map<const Mat>(visited.data(), env.Spec().S, Index(o.size()));

  Mat& W_o = embedding->value;
  const Mat kept = W_o;
  struct Restore {  // also when a query throws
    Mat& W_o;
    const Mat& kept;
    ~Restore() { W_o = kept; }
  } const restore{W_o, kept};
  MatD J;
  Mat mu, moved, sigma;
  policy.MeanJacobian(s, o, J);
  policy.ActionPolicy(s, o, mu, sigma);
  MatD perturbed(W_o.rows(), mu.rows());
  for (Index d = 0; d < W_o.rows(); ++d) {
    W_o.row(d).array() += static_cast<Real>(delta);
    policy.ActionPolicy(s, o, moved, sigma);
    perturbed.row(d) = (moved.cast<double>() - mu.cast<double>()).rowwise().mean().transpose();
    W_o.row(d) = kept.row(d);
  }
  return {kept.cast<double>(), J.transpose(), perturbed, delta, s.cols()};
}

std::string InterpretationCsv(const Interpretation& x) {
  const std::pair<const char*, const MatD*> parts[] = {
      {"embedding_", &x.W_o}, {"effect_", &x.effect}, {"perturbed_", &x.perturbed}};
  CsvTable table;
  table.columns = {kFirstColumn};
  for (const auto& [name, part] : parts) {
    for (Index i = 0; i < part->cols(); ++i) table.columns.push_back(Concat(name, i));
  }
  table.columns.push_back("delta");
  for (Index d = 0; d < x.W_o.rows(); ++d) {
    table.values.push_back(static_cast<double>(d));
    for (const auto& [name, part] : parts) {
      for (Index i = 0; i < part->cols(); ++i) table.values.push_back((*part)(d, i));
    }
    table.values.push_back(x.delta);
  }
  return CsvText(table);
}

std::string InterpretationJson(const Interpretation& x, const Metadata& checkpoint,
                               const std::string& task, int episodes, std::uint64_t seed) {
  auto out = nlohmann::ordered_json::parse(BuildJson());
  out["task"] = task;
  out["episodes"] = episodes;
  out["seed"] = seed;
  out["states"] = x.states;
  if (const auto steps = TotalSteps(checkpoint)) out["steps"] = *steps;
  if (const auto found = checkpoint.find("config"); found != checkpoint.end()) {
    out["config"] = found->second;
  }
  return out.dump(2) + "\n";
}

fs::path InterpretationPath(const RunConfig& config, const std::string& task) {
  std::string variant = ToString(config.fidelity);
  const Switches plain = SwitchesFor(config.fidelity);
  for (const SwitchInfo& info : SwitchRegistry()) {
    const std::string value = SwitchValue(config.switches, info);
    if (Concerns(info, config) && value != SwitchValue(plain, info)) {
      variant += Concat("-", info.name, "=", value);
    }
  }
  return fs::path("results") / "interpret" / variant / task / config.algorithm /
         (SeedFolder(config.seed) + ".csv");
}

std::optional<fs::path> BesideInterpretation(const fs::path& csv) {
  if (IsStream(csv)) return std::nullopt;
  return fs::path(csv).replace_extension(".json");
}

void RequireInterpretationPlace(const fs::path& csv) {
  if (csv.extension() == ".json") {
    throw ConfigError(csv.string() +
                      ": --out names the CSV file; a .json file is written beside it");
  }
  const auto json = BesideInterpretation(csv);
  if (!json) return;
  for (const fs::path& path : {csv, *json}) {
    RequireWritable(path);
    if (!fs::exists(path)) continue;
    const std::string text = ReadFile(path);
    if (path == csv ? !text.starts_with(Concat(kFirstColumn, ",")) : !IsInterpretation(text)) {
      throw ConfigError(path.string() + ": not written by `interpret`; move it away first");
    }
  }
}

}  // namespace o2v
