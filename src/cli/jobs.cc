// jobs, progress: the runs of experiments, what is to do and what is done.

#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/printable.h"
#include "cli/commands.h"
#include "cli/options.h"
#include "report/jobs.h"

namespace o2v {
namespace {

std::vector<std::string> RefusedOf(const std::vector<Job>& jobs) {
  std::vector<std::string> refused;
  for (const Job& job : jobs) {
    if (!job.refused.empty()) refused.push_back(job.refused);
  }
  return refused;
}

/// Options that name a grid of runs, of `jobs` and `progress`.
struct GridOptions {
  JobQuery query;
  std::optional<std::string> seeds;

  void Add(CLI::App& app) {
    app.add_option("experiments", query.configs,
                   "a .toml file, or a built-in suite: quick, single_task, ...")
        ->required();
    app.add_option("--tasks", query.tasks,
                   "A,B instead of the experiment's; with several experiments: the tasks to take")
        ->delimiter(',');
    app.add_option("--algos", query.algorithms,
                   "methods instead of the experiment's; of an ablation: the methods to take")
        ->delimiter(',');
    app.add_option("--fidelity", query.fidelities, "fidelities instead of the experiment's")
        ->delimiter(',');
    app.add_option("--seeds", seeds, "seeds instead of the experiment's, such as 0-4,7");
    app.add_option("--results", query.results, "folder of all results")->capture_default_str();
  }
  std::vector<Job> List() {
    if (seeds) query.seeds = ParseSeeds(*seeds);
    return ListJobs(query);
  }
};

}  // namespace

void AddJobs(CLI::App& app, const std::string& program) {
  auto opt = std::make_shared<GridOptions>();
  opt->query.program = program;
  CLI::App* jobs = app.add_subcommand("jobs", "list the runs of experiments, one command per line");
  opt->Add(*jobs);
  jobs->footer(
      "A command starts its run or continues it. Finished and diverged runs are left out.\n"
      "Those made by an older revision of the method are named on standard error.\n"
      "Example:\n  option2vec jobs quick --seeds 0-4 | xargs -P 2 -d '\\n' -n 1 sh -c");
  jobs->callback([opt] {
    const std::vector<Job> list = opt->List();
    for (const Job& job : list) {
      if (!job.refused.empty()) continue;
      if (!job.finished) {
        std::cout << job.command << "\n";
      } else if (job.old) {
        std::cerr << Printable(job.dir.string()) << ": made by an older revision of the method\n";
      }
    }
    NameRefused(RefusedOf(list));
  });
}

void AddProgress(CLI::App& app) {
  struct Options : GridOptions {
    int at_once = 1;
  };
  auto opt = std::make_shared<Options>();
  CLI::App* progress = app.add_subcommand(
      "progress", "show how many runs of experiments are done and how long the rest takes");
  opt->Add(*progress);
  AddWhole(*progress, "--at-once", opt->at_once, 1, kMaxInt, "number of runs at a time")
      ->default_str("1");
  progress->footer(
      "The time left is estimated from finished runs of the same kind.\n"
      "Example:\n  option2vec progress single_task transfer --fidelity paper --at-once 2");
  progress->callback([opt] {
    const std::vector<Job> list = opt->List();
    std::cout << ToString(MeasureProgress(list), opt->at_once) << "\n";
    NameRefused(RefusedOf(list));
  });
}

}  // namespace o2v
