// record: the records of finished runs anew.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/check.h"
#include "base/files.h"
#include "cli/commands.h"
#include "run/config.h"
#include "run/manifest.h"
#include "run/record.h"

namespace o2v {

void AddRecord(CLI::App& app) {
  auto runs = std::make_shared<std::vector<std::string>>();
  CLI::App* record = app.add_subcommand("record", "rewrite the records of finished runs");
  record->add_option("runs", *runs, "folders of runs")->required();
  record->footer(
      "`train` writes the record when a run ends. This command renews records of an older "
      "version.\n"
      "Example:\n  option2vec record results/quick/paper/*/ppo/seed-000");
  record->callback([runs] {
    for (const std::string& run : *runs) {
      const std::filesystem::path dir = FolderPath(run);
      const auto manifest = ReadManifest(dir);
      if (!manifest ||
          (manifest->status != RunStatus::kDone && manifest->status != RunStatus::kDiverged)) {
        throw ConfigError(run + ": not the folder of a finished run");
      }
      const std::string path = (dir / "config.toml").string(), config = ReadFile(path);
      RequireRecordPlace(dir, config, /*begun=*/true);
      WriteRecord(dir, ReadFile(dir / "manifest.json"), ParseRunConfig(config, path).steps);
    }
  });
}

}  // namespace o2v
