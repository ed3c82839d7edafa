// Lists of seeds, and the lines that `jobs` prints. The input is three words, separated by NUL:
// seeds, program, folder of the results.

#include "report/jobs.h"

#include <algorithm>
#include <vector>

#include "fuzz/target.h"

namespace o2v {
namespace {

/// The words of a command in which only apostrophes and backslashes quote, as a POSIX shell has it.
std::vector<std::string> ShellWords(std::string_view command) {
  std::vector<std::string> words(1);
  bool quoted = false;
  for (std::size_t i = 0; i < command.size(); ++i) {
    const char c = command[i];
    if (c == '\'') {
      quoted = !quoted;
    } else if (c == '\\' && !quoted) {
      words.back() += command[++i];
    } else if (c == ' ' && !quoted) {
      words.emplace_back();
    } else {
      words.back() += c;
    }
  }
  return words;
}

void Try(std::string_view input) {
  const std::size_t first = std::min(input.find('\0'), input.size());
  const std::size_t second = std::min(input.find('\0', first + 1), input.size());
  JobQuery query;
  if (!Accepts([&] { query.seeds = ParseSeeds(std::string(input.substr(0, first))); })) return;
  Expect(!query.seeds.empty());
  query.seeds.resize(1);
  if (second == input.size()) return;
  query.program = input.substr(first + 1, second - first - 1);
  // Below a folder that does not exist: nothing is looked up elsewhere.
  query.results = "/nowhere/" + std::string(input.substr(second + 1)).substr(0, 200);
  if (query.results.string().find('\0') != std::string::npos) return;
  query.configs = {"quick"};
  query.tasks = {"Hopper-v2"};
  query.algorithms = {"ppo"};
  query.fidelities = {"paper"};
  std::vector<Job> jobs;
  if (!Accepts([&] { jobs = ListJobs(query); })) return;
  Expect(jobs.size() == 1 && jobs[0].command.find('\n') == std::string::npos);
  const std::vector<std::string> words = ShellWords(jobs[0].command);
  Expect(words.size() == 17 && words[0] == query.program && words[15] == jobs[0].dir.string());
}

}  // namespace
}  // namespace o2v

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  o2v::Try(o2v::Bytes(data, size));
  return 0;
}
