// Prints all gradient checks, one a line, and writes them as CSV: gradcheck [PATH].

#include <cstdio>
#include <exception>
#include <limits>
#include <string>

#include "base/check.h"
#include "base/files.h"
#include "gradcheck/checks.h"

namespace {

/// A check that throws, as where a loss is not that of the specification, fails like another.
o2v::Verdict Run(const o2v::NamedCheck& check) {
  try {
    return o2v::RewardAndEnd(check.run());
  } catch (const o2v::Error& e) {
    o2v::Verdict verdict;
    verdict.largest_error = std::numeric_limits<double>::infinity();
    verdict.worst = e.what();
    return verdict;
  }
}

}  // namespace

int main(int argc, char** argv) try {
  const std::string path = argc > 1 ? argv[1] : "results/gradcheck.csv";
  std::string csv = "name,entries,largest_gradient,largest_error\n";
  std::printf("%-62s %8s %17s %14s\n", "name", "entries", "largest_gradient", "largest_error");
  int failed = 0, total = 0;
  for (const o2v::NamedCheck& check : o2v::AllChecks()) {
    const o2v::Verdict v = Run(check);
    std::printf("%-62s %8zu %17.3e %14.2e%s%s\n", check.name.c_str(), v.entries, v.largest_gradient,
                v.largest_error, v.Passed() ? "" : "  FAIL ", v.Passed() ? "" : v.worst.c_str());
    csv += o2v::Concat(check.name, ",", v.entries, ",", v.largest_gradient, ",", v.largest_error,
                       "\n");
    failed += !v.Passed();
    ++total;
  }
  o2v::WriteFileAtomically(path, csv);
  std::printf("%d of %d checks below %.0e\n", total - failed, total, o2v::kTolerance);
  return failed == 0 ? 0 : 1;
} catch (const std::exception& e) {
  std::fprintf(stderr, "gradcheck: %s\n", e.what());
  return 1;
}
