// params: parameters by task, method and width.

#include <iostream>
#include <memory>

#include "cli/commands.h"
#include "report/param_table.h"

namespace o2v {

void AddParams(CLI::App& app) {
  auto csv = std::make_shared<bool>(false);
  CLI::App* params = app.add_subcommand("params", "count parameters by task, method and width");
  params->add_flag("--csv", *csv, "print CSV");
  params->footer("Example:\n  option2vec params --csv");
  params->callback([csv] {
    const auto rows = ParamTable();
    std::cout << (*csv ? ParamCsv(rows) : ParamText(rows));
  });
}

}  // namespace o2v
