#include "report/param_table.h"

#include <algorithm>
#include <functional>
#include <iomanip>
#include <sstream>
#include <tuple>

#include "base/check.h"
#include "report/align.h"

namespace o2v {
namespace {

constexpr const char* kOption2Vec = "option2vec";
constexpr int kWidths[] = {64,
                           128};  // DAC's, and the one of the authors' later baselines; spec 2.6

struct Task {
  std::string name, config;  // config: the registry's task whose numbers apply
  int S, A;
};

std::vector<Task> Tasks() {
  std::vector<Task> tasks;
  for (const EnvEntry& entry : EnvRegistry()) {
    if (entry.id.starts_with("dm-")) continue;  // by domain, below
    const EnvSpec spec = MakeEnv(entry.id, {})->Spec();
    tasks.push_back({entry.id, entry.id, spec.S, spec.A});
  }
  const std::string config = tasks.front().name;
  for (const auto& [domain, S, A] : {std::tuple{"dm_cartpole", 5, 1},
                                     {"dm_reacher", 6, 2},
                                     {"dm_cheetah", 17, 6},
                                     {"dm_fish", 21, 5},
                                     {"dm_walker", 24, 6}}) {  // spec 6
    tasks.push_back({domain, config, S, A});
  }
  return tasks;
}

/// Counts the method's networks; they are made for it and thrown away.
ParamRow Count(const Task& task, const RunConfig& config) {
  EnvSpec spec;
  spec.S = task.S;
  spec.A = task.A;
  const auto algorithm = MakeRunAlgorithm(config, spec, /*draw_weights=*/false);
  ParamRow row;
  row.task = task.name;
  row.S = task.S;
  row.A = task.A;
  row.method = config.algorithm;
  row.fidelity = config.fidelity;
  row.width = config.hyper.Int("hidden");
  row.counted = CountParams(algorithm->Params());
  row.used = CountUsed(*algorithm);
  return row;
}

/// Rows of one task and fidelity.
std::vector<ParamRow> Rows(const Task& task, const std::string& fidelity) {
  std::vector<ParamRow> rows;
  Index option2vec = 0;
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    RunRequest request;
    request.task = task.config;
    request.algorithm = method.id;
    request.fidelity = fidelity;
    RunConfig config = ResolveRun(request);
    config.workers = 1;
    if (method.id == kOption2Vec) {
      rows.push_back(Count(task, config));
      option2vec = rows.back().counted;
      continue;
    }
    for (const int width : kWidths) {
      config.hyper.Set("hidden", width, "parameter table");
      rows.push_back(Count(task, config));
    }
  }
  for (ParamRow& row : rows) {
    if (row.method != kOption2Vec && row.method != "ppo") {
      row.share = double(option2vec) / double(row.counted);
    }
  }
  return rows;
}

std::string Fixed(double x, int digits) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(digits) << x;
  return out.str();
}

/// A whole number, right-aligned.
std::string Whole(Index n) {
  constexpr std::size_t kDigits = 6;
  const std::string text = std::to_string(n);
  return std::string(kDigits - std::min(kDigits, text.size()), ' ') + text;
}

/// The row of a network, null when it is not in the table.
const ParamRow* Find(const std::vector<ParamRow>& rows, const std::string& task,
                     const std::string& method, Fidelity fidelity, int width) {
  const auto row = std::find_if(rows.begin(), rows.end(), [&](const ParamRow& r) {
    return r.task == task && r.method == method && r.fidelity == fidelity && r.width == width;
  });
  return row == rows.end() ? nullptr : &*row;
}

bool SameSize(const ParamRow* a, const ParamRow* b) {
  if (!a || !b) return a == b;
  return a->counted == b->counted && a->used == b->used;
}

/// counted, used and share of a row, with the share of `other` as well; "-" for what there is not.
std::vector<std::string> Cells(const ParamRow* row, const ParamRow* other) {
  if (!row) return {"     -", "     -", "-"};
  std::string share = row->share ? Fixed(100 * *row->share, 1) : "-";
  if (other && other->share) share += ", " + Fixed(100 * *other->share, 1);
  return {Whole(row->counted), Whole(row->used), share};
}

/// The paper's claim, from the table's own cells. Source: spec 2.6.
std::string Note(const std::vector<ParamRow>& rows) {
  const auto quotient = [&](int width) {
    const auto of = [&](const char* method, int h) {
      const ParamRow* row = Find(rows, "HalfCheetah-v2", method, Fidelity::kReleased, h);
      Check(row, "no row of ", method, " with width ", h);
      return row->counted;
    };
    const Index ours = of(kOption2Vec, 64), network = of("dac_ppo", width);
    return Concat(ours, " / ", network, " = ", Fixed(100.0 * double(ours) / double(network), 1),
                  " %");
  };
  return Concat(
      "\nh is the width of both hidden layers. Option2Vec always has h = 64 and the embedding "
      "dimension of\n"
      "the gym tasks. used: parameters that some loss can reach. O2V %: Option2Vec's parameters "
      "in percent\n"
      "of the line's; first of paper, then of released, when one line shows both.\n"
      "\nThe paper's 15.8 % is HalfCheetah-v2 (S = 17, A = 6), h = 128, released, against the "
      "network that\ndac_ppo, ahp_ppo, iopg, ppoc and oc share: ",
      quotient(128), ", unused parameters\nincluded. Against DAC's own width 64 it is ",
      quotient(64), ".\n");
}

}  // namespace

std::vector<char> InAnyGraph(const Algorithm& algorithm) {
  std::vector<char> any = algorithm.InGraph(0);
  for (int stage = 1; stage < int(algorithm.StageNames().size()); ++stage) {
    const std::vector<char> in_graph = algorithm.InGraph(stage);
    std::transform(any.begin(), any.end(), in_graph.begin(), any.begin(), std::logical_or<>());
  }
  return any;
}

Index CountUsed(Algorithm& algorithm) {
  const std::vector<char> used = InAnyGraph(algorithm);
  const std::vector<Param*> params = algorithm.Params();
  Index n = 0;
  for (std::size_t i = 0; i < params.size(); ++i) n += used[i] ? params[i]->value.size() : 0;
  return n;
}

std::vector<ParamRow> ParamTable() {
  std::vector<ParamRow> table;
  for (const Task& task : Tasks()) {
    for (const char* fidelity : {"paper", "released"}) {
      const std::vector<ParamRow> rows = Rows(task, fidelity);
      table.insert(table.end(), rows.begin(), rows.end());
    }
  }
  return table;
}

std::string ParamCsv(const std::vector<ParamRow>& rows) {
  std::string text = "task,S,A,method,fidelity,width,counted,used,share\n";
  for (const ParamRow& row : rows) {
    text += Concat(row.task, ",", row.S, ",", row.A, ",", row.method, ",", ToString(row.fidelity),
                   ",", row.width, ",", row.counted, ",", row.used, ",",
                   row.share ? Fixed(*row.share, 6) : std::string(), "\n");
  }
  return text;
}

std::string ParamText(const std::vector<ParamRow>& rows) {
  std::vector<std::vector<std::string>> lines = {{"task", "S", "A", "method", "fidelity", "  h=64",
                                                  "  used", "O2V %", " h=128", "  used", "O2V %"}};
  std::string task;
  for (const ParamRow& row : rows) {
    if (row.fidelity != Fidelity::kPaper || row.width != kWidths[0]) continue;
    const auto at = [&](Fidelity fidelity, int width) {
      return Find(rows, row.task, row.method, fidelity, width);
    };
    const bool one = std::all_of(std::begin(kWidths), std::end(kWidths), [&](int width) {
      return SameSize(at(Fidelity::kPaper, width), at(Fidelity::kReleased, width));
    });
    for (const Fidelity fidelity : {Fidelity::kPaper, Fidelity::kReleased}) {
      if (one && fidelity == Fidelity::kReleased) break;
      std::vector<std::string> line = {"", "", "", row.method, one ? "both" : ToString(fidelity)};
      if (row.task != task) {
        line[0] = task = row.task;
        line[1] = std::to_string(row.S);
        line[2] = std::to_string(row.A);
      }
      for (const int width : kWidths) {
        const auto cells =
            Cells(at(fidelity, width), one ? at(Fidelity::kReleased, width) : nullptr);
        line.insert(line.end(), cells.begin(), cells.end());
      }
      lines.push_back(std::move(line));
    }
  }
  return AlignColumns(lines) + Note(rows);
}

}  // namespace o2v
