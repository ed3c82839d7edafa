#include "run/evaluate.h"

#include <algorithm>
#include <span>
#include <string>

#include "base/check.h"
#include "base/csv.h"
#include "base/files.h"
#include "dist/categorical.h"

namespace o2v {
namespace {

/// Appends the columns "<name>0", "<name>1", ...
void AddColumns(CsvTable& table, const std::string& name, Index n) {
  for (Index i = 0; i < n; ++i) table.columns.push_back(Concat(name, i));
}

template <typename Matrix>
void AppendColumn(const Matrix& x, Index b, std::vector<double>& values) {
  for (Index i = 0; i < x.rows(); ++i) values.push_back(static_cast<double>(x(i, b)));
}

/// A whole number in [0, n) from a table.
int ReadIndex(const CsvTable& table, std::size_t row, std::size_t column, int n) {
  const double x = table.At(row, column);
  for (int i = 0; i < n; ++i) {
    if (x == i) return i;
  }
  throw Error(Concat(table.Place(row, column), "got ", x, ", not a whole number in [0, ", n, ")"));
}

}  // namespace

std::vector<EvalEpisode> Evaluate(Policy& policy, const Normalizer& normalizer, Env& env,
                                  int episodes, bool sample_action, std::uint64_t seed,
                                  const StepHook& visit, const std::function<bool()>& stop) {
  const EnvSpec& spec = env.Spec();
  Rng resets(seed, "eval.reset"), options(seed, "eval.option"), actions(seed, "eval.action");
  VecD raw(spec.S), before(spec.S);
  Mat s(spec.S, 1), P, mu, sigma;
  Vec state(spec.S);
  std::vector<double> a(static_cast<std::size_t>(spec.A));
  std::vector<int> o = {0}, o_prev = {0};
  std::vector<char> init = {1};
  const std::span<double> obs(raw.data(), static_cast<std::size_t>(raw.size()));

  std::vector<EvalEpisode> results;
  for (int e = 0; e < episodes; ++e) {
    EvalEpisode episode{0, 0};
    env.Reset(resets, obs);
    init[0] = 1;
    for (bool done = false; !done;) {
      if (stop && stop()) return results;
      normalizer.Apply(raw, state);
      s = state;
      policy.OptionPolicy(s, o_prev, init, P);
      SampleCategorical(P, options, o);
      policy.ActionPolicy(s, o, mu, sigma);
      for (std::size_t j = 0; j < a.size(); ++j) {
        const Index row = static_cast<Index>(j);
        double x = static_cast<double>(mu(row, 0));
        if (sample_action) x += static_cast<double>(sigma(row, 0)) * actions.Normal();
        a[j] = std::clamp(x, spec.a_low[j], spec.a_high[j]);
      }
      before = raw;
      const StepResult step = env.Step(a, obs);
      if (visit) visit({e, episode.length, before, s, P, o[0], a, step.reward});
      episode.ret += step.reward;
      ++episode.length;
      done = step.terminated || step.truncated;
      o_prev = o;
      init[0] = 0;
    }
    results.push_back(episode);
  }
  return results;
}

CsvTable NewTrajectory(const EnvSpec& spec, int K) {
  CsvTable table;
  table.columns = {"episode", "step", "o"};
  AddColumns(table, "P", K);
  AddColumns(table, "a", spec.A);
  table.columns.push_back("reward");
  AddColumns(table, "obs", spec.S);
  return table;
}

void Append(const EvalStep& step, CsvTable& trajectory) {
  std::vector<double>& values = trajectory.values;
  values.insert(values.end(), {double(step.episode), double(step.t), double(step.o)});
  AppendColumn(step.P, 0, values);
  values.insert(values.end(), step.a.begin(), step.a.end());
  values.push_back(step.reward);
  AppendColumn(step.obs, 0, values);
}

void Forward(Policy& policy, const EnvSpec& spec, const std::filesystem::path& input,
             const std::filesystem::path& output) {
  const CsvTable in = ReadCsv(input);
  const std::size_t n = in.Rows(), expected = static_cast<std::size_t>(spec.S) + 3;
  Check(in.columns.size() == expected, in.path, ":1: ", in.columns.size(), " columns, not the ",
        expected, " of s0.. (", spec.S, "), o_prev, init, o");
  const int K = policy.NumOptions();
  Mat s(spec.S, static_cast<Index>(n));
  std::vector<int> o(n), o_prev(n);
  std::vector<char> init(n);
  for (int i = 0; i < spec.S; ++i) {
    const std::size_t column = in.Column(Concat("s", i));
    for (std::size_t b = 0; b < n; ++b) s(i, Index(b)) = static_cast<Real>(in.At(b, column));
  }
  for (std::size_t b = 0; b < n; ++b) {
    o_prev[b] = ReadIndex(in, b, in.Column("o_prev"), K);
    init[b] = static_cast<char>(ReadIndex(in, b, in.Column("init"), 2));
    o[b] = ReadIndex(in, b, in.Column("o"), K);
  }

  Mat P, mu, sigma, q;
  policy.OptionPolicy(s, o_prev, init, P);
  policy.ActionPolicy(s, o, mu, sigma);
  policy.OptionValues(s, o, q);
  CsvTable out;
  const std::pair<const char*, const Mat*> outputs[] = {
      {"P", &P}, {"mu", &mu}, {"sigma", &sigma}, {"q", &q}};
  for (const auto& [name, x] : outputs) AddColumns(out, name, x->rows());
  for (Index b = 0; b < s.cols(); ++b) {
    for (const auto& [name, x] : outputs) AppendColumn(*x, b, out.values);
  }
  WriteFileAtomically(output, CsvText(out));
}

}  // namespace o2v
