// Prints the parity table and writes it as a CSV file; exit code 1 when a bound is broken.
// Usage: parity [OUT.csv], by default results/parity.csv.

#include <cstdio>
#include <exception>

#include "parity/physics_parity.h"

namespace {

int Run(const std::filesystem::path& out) {
  bool pass = true;
  std::string csv = "check,name,deviation,bound,where,deviation_all_rows\n";
  std::printf(
      "model: share of the tolerance 1e-14 + 1e-9|b|; others: |a-b| / max(1,|b|), first %zu "
      "rows of a segment\n%-11s %-29s %9s %7s %10s  %s\n",
      o2v::kBoundRows, "check", "name", "deviation", "bound", "all rows", "where");
  for (const o2v::ParityRow& row : o2v::PhysicsParity(O2V_TEST_DATA)) {
    std::printf("%-11s %-29s %9.2g %7.0g %10.2g  %s%s\n", row.check.c_str(), row.name.c_str(),
                row.deviation, row.bound, row.all_rows, row.where.c_str(),
                row.Pass() ? "" : "  FAIL");
    char numbers[64];
    std::snprintf(numbers, sizeof numbers, "%.3g,%.3g", row.deviation, row.bound);
    csv += row.check + "," + row.name + "," + numbers + "," + row.where;
    std::snprintf(numbers, sizeof numbers, ",%.3g\n", row.all_rows);
    csv += numbers;
    pass = pass && row.Pass();
  }
  if (out.has_parent_path()) std::filesystem::create_directories(out.parent_path());
  o2v::WriteFileAtomically(out, csv);
  std::printf("%s, table in %s\n", pass ? "PASS" : "FAIL", out.c_str());
  return pass ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Run(argc > 1 ? argv[1] : "results/parity.csv");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "parity: %s\n", error.what());
    return 2;
  }
}
