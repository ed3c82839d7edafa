#include "report/param_table.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <string>

#include "base/files.h"

namespace o2v {
namespace {

const std::filesystem::path kFile = std::filesystem::path(O2V_TEST_DATA) / "golden/params.csv";

/// The table on record, which one test compares with the one that the program makes.
std::vector<ParamRow> Recorded() {
  std::istringstream file(ReadFile(kFile));
  std::vector<ParamRow> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::vector<std::string> cells;
    for (std::istringstream in(line + ","); std::getline(in, line, ',');) cells.push_back(line);
    ParamRow row;
    row.task = cells.at(0);
    row.S = std::stoi(cells.at(1));
    row.A = std::stoi(cells.at(2));
    row.method = cells.at(3);
    row.fidelity = ParseFidelity(cells.at(4));
    row.width = std::stoi(cells.at(5));
    row.counted = std::stol(cells.at(6));
    row.used = std::stol(cells.at(7));
    if (!cells.at(8).empty()) row.share = std::stod(cells.at(8));
    rows.push_back(row);
  }
  return rows;
}

// ---- The specification's closed forms ----------------------------------------------------------

constexpr Index K = 4, D = 40, F = 50, kInit = 64;  // spec 2.6, 7; kInit is fixed, not h

/// Linear layer (n_in -> n_out).
Index L(Index n_in, Index n_out) { return n_in * n_out + n_out; }
/// Body; spec 2.1.
Index Body(Index i, Index h) { return L(i, h) + L(h, h); }
/// The net of the state alone: initial options (spec 2.6 item 2), y (2.4).
Index StateNet(Index S) { return L(S, kInit) + L(kInit, K); }

struct Size {
  Index counted, used;
};

/// The network of DAC+PPO, PPOC, OC, AHP+PPO and IOPG; spec 2.3.
Index OptionNetwork(Index S, Index A, Index h) {
  return (2 + 2 * K) * Body(S, h) + 2 * (h * K + K) + h * (K + 1) + (K + 1) +
         K * ((h * A + A) + (h + 1) + A);
}

Size Expected(const ParamRow& row) {
  const Index S = row.S, A = row.A, h = row.width;
  const bool paper = row.fidelity == Fidelity::kPaper;
  if (row.method == "ppo") {  // spec 2.2
    const Index n = 2 * Body(S, h) + (h + 1) * A + (h + 1) + A;
    return {n, n};
  }
  if (row.method == "option2vec") {
    const Index block = 4 * D * D + 4 * D + 2 * D * F + F + D + 6 * D,
                action = Body(S + D, h) + 2 * (h * A + A);
    if (paper) {  // spec 2.7
      const Index n = K * D + StateNet(S) + ((S + D) * D + D + 2 * D) + block + (D * K + K) +
                      action + (Body(S + D, h) + h + 1);
      return {n, n};
    }
    // Spec 2.6, items 1 to 8; item 9 is never used.
    const Index n = K * D + StateNet(S) + (S * D + D + 2 * D) + block + (2 * D * K + K) + action +
                    (2 * (S + D) + Body(S + D, h) + h * K + K);
    return {n + 2 * (S + D), n};
  }
  const Index u = h * (K + 1) + (K + 1), q = h * K + K, terminations = K * (Body(S, h) + (h + 1));
  if (row.method == "dac_onestep") {
    if (paper) {  // spec 2.5
      const Index n = Body(S + K, h) + (h + 1) * K + K * (Body(S, h) + (h + 1) * A + A) +
                      Body(S, h) + (h + 1) * K;
      return {n, n};
    }
    const Index n = OptionNetwork(S, A, h) + h + StateNet(S) + 2 * (S + 1);  // spec 2.4
    return {n, n - u - terminations};
  }
  // Spec 2.3. Released IOPG never uses its terminations (4.5 (g)), but they are in its graph.
  const std::map<std::string, Index> unused = {
      {"dac_ppo", u}, {"iopg", u}, {"ppoc", u}, {"ahp_ppo", q}, {"oc", u + Body(S, h) + q}};
  const Index n = OptionNetwork(S, A, h);
  return {n, n - unused.at(row.method)};
}

// ---- Tests -------------------------------------------------------------------------------------

TEST(ParamTable, IsTheOneOnRecord) {
  const std::string now = ParamCsv(ParamTable());
  if (std::getenv("O2V_REWRITE_GOLDEN")) WriteFileAtomically(kFile, now);
  EXPECT_EQ(now, ReadFile(kFile));
}

TEST(ParamTable, FollowsFromTheSizesCellByCell) {
  for (const ParamRow& row : Recorded()) {
    const Size expected = Expected(row);
    const auto name = row.task + " " + row.method + " " + ToString(row.fidelity) + " " +
                      std::to_string(row.width);
    EXPECT_EQ(row.counted, expected.counted) << name;
    EXPECT_EQ(row.used, expected.used) << name;
    ASSERT_EQ(row.share.has_value(), row.method != "ppo" && row.method != "option2vec") << name;
    if (!row.share) continue;
    ParamRow ours = row;
    ours.method = "option2vec";
    ours.width = 64;
    EXPECT_NEAR(*row.share, double(Expected(ours).counted) / double(expected.counted), 5e-7)
        << name;
  }
}

TEST(ParamTable, HasEveryTaskMethodFidelityAndWidthOnce) {
  const std::vector<ParamRow> rows = Recorded();
  std::set<std::string> tasks, cells;
  for (const ParamRow& row : rows) {
    tasks.insert(row.task);
    cells.insert(row.task + row.method + ToString(row.fidelity) + std::to_string(row.width));
  }
  EXPECT_EQ(tasks.size(), 15u);  // ten of gym, five domains of DeepMind Control
  // Two fidelities of Option2Vec, and of seven methods in two widths.
  EXPECT_EQ(rows.size(), 15u * (2 + 7 * 2 * 2));
  EXPECT_EQ(cells.size(), rows.size());
}

/// Smallest and largest share of released Option2Vec in the option network of width h.
std::pair<ParamRow, ParamRow> Extremes(int h) {
  ParamRow least, most;
  for (const ParamRow& row : Recorded()) {
    if (row.method != "dac_ppo" || row.fidelity == Fidelity::kPaper || row.width != h) continue;
    if (!least.share || *row.share < *least.share) least = row;
    if (!most.share || *row.share > *most.share) most = row;
  }
  return {least, most};
}

// Spec 2.6: "h=128: 15.4 % InvertedPendulum ... 17.7 % Humanoid; h=64: 40 % ... 58 %".
TEST(ParamTable, HasThePapersRatiosAndTheirRanges) {
  for (const ParamRow& row : Recorded()) {
    if (row.task == "HalfCheetah-v2" && row.method == "dac_ppo" &&
        row.fidelity == Fidelity::kReleased) {
      EXPECT_NEAR(*row.share, row.width == 128 ? 0.158151 : 0.548263, 5e-7);
    }
  }
  const auto [least128, most128] = Extremes(128);
  EXPECT_EQ(least128.task, "InvertedPendulum-v2");
  EXPECT_NEAR(*least128.share, 0.154, 5e-4);
  EXPECT_EQ(most128.task, "Humanoid-v2");
  EXPECT_NEAR(*most128.share, 0.177, 5e-4);
  const auto [least64, most64] = Extremes(64);
  EXPECT_EQ(least64.task, "Humanoid-v2");
  EXPECT_NEAR(*least64.share, 0.40, 5e-3);
  EXPECT_EQ(most64.task, "InvertedPendulum-v2");
  EXPECT_NEAR(*most64.share, 0.58, 5e-3);
}

TEST(ParamTable, TextNamesThePapersCellAndStaysReadable) {
  const std::string text = ParamText(Recorded());
  EXPECT_NE(text.find("30598 / 193473 = 15.8 %"), std::string::npos);
  EXPECT_NE(text.find("30598 / 55809 = 54.8 %"), std::string::npos);
  std::istringstream lines(text);
  std::size_t n = 0;
  for (std::string line; std::getline(lines, line) && !line.empty(); ++n) {
    EXPECT_LE(line.size(), 120u) << line;
  }
  // A header, then for each task two lines of Option2Vec and DAC-OneStep (which differ between the
  // fidelities) and one of each of the other six methods.
  EXPECT_EQ(n, 1u + 15 * (2 * 2 + 6));
}

}  // namespace
}  // namespace o2v
