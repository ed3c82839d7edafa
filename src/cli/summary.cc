// summary: an experiment's results beside the authors'.

#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "base/check.h"
#include "base/files.h"
#include "cli/commands.h"
#include "cli/options.h"
#include "report/summary.h"

namespace o2v {

void AddSummary(CLI::App& app) {
  auto folders = std::make_shared<std::vector<std::string>>();
  CLI::App* summary =
      app.add_subcommand("summary", "print an experiment's results beside the authors'");
  summary->add_option("experiment", *folders, "results/<experiment>")->required();
  summary->footer(
      "The table also goes into <experiment>/summary.csv.\n"
      "Example:\n  option2vec summary results/quick");
  summary->callback([folders] {
    for (const std::string& folder : *folders) {
      const auto [rows, refused] = Summarize(folder);
      NameRefused(refused);
      if (rows.empty()) throw ConfigError(folder + ": no record of a finished run");
      WriteFileAtomically(std::filesystem::path(folder) / "summary.csv", SummaryCsv(rows));
      std::cout << folder << "\n" << SummaryTable(rows) << "\n";
    }
  });
}

}  // namespace o2v
