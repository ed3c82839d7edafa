// Prints every statement of the paper's theory, one a line, and writes them as CSV: theory [PATH].

#include <cstdio>
#include <exception>
#include <string>

#include "base/files.h"
#include "exact/statements.h"

int main(int argc, char** argv) try {
  const std::string path = argc > 1 ? argv[1] : "results/theory.csv";
  std::string csv = "name,gap,relation,tolerance,verdict,compared\n";
  std::printf("%-64s %9s %9s  %-4s  compared\n", "name", "gap", "tolerance", "");
  int failed = 0, total = 0;
  for (const o2v::exact::Statement& statement : o2v::exact::AllStatements()) {
    const double gap = o2v::exact::WorstOf(statement).gap;
    const char relation = static_cast<char>(statement.relation);
    const char* verdict = statement.Holds(gap) ? "PASS" : "FAIL";
    std::printf("%-64s %9.2e %c %7.0e  %s  %s\n", statement.name.c_str(), gap, relation,
                statement.bound, verdict, statement.compared.c_str());
    char numbers[64];
    std::snprintf(numbers, sizeof numbers, ",%.3g,%c,%.3g,%s,", gap, relation, statement.bound,
                  verdict);
    csv += statement.name + numbers + statement.compared + "\n";
    failed += !statement.Holds(gap);
    ++total;
  }
  o2v::WriteFileAtomically(path, csv);
  std::printf("%d of %d statements hold, each on %d random processes; table in %s\n",
              total - failed, total, o2v::exact::kInstances, path.c_str());
  return failed == 0 ? 0 : 1;
} catch (const std::exception& e) {
  std::fprintf(stderr, "theory: %s\n", e.what());
  return 1;
}
