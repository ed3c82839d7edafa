// The methods against the reference numbers of tests/data/oracles.

#include <gtest/gtest.h>

#include "base/check.h"
#include "oracles/oracle.h"

namespace o2v {
namespace {

const std::filesystem::path kFolder = std::filesystem::path(O2V_TEST_DATA) / "oracles";

class Oracle : public testing::TestWithParam<std::string> {};

TEST_P(Oracle, IsMatched) {
  const Comparison result = CompareOracle(ReadOracle(kFolder / (GetParam() + ".json")));
  EXPECT_TRUE(result.Passed()) << "deviation " << result.deviation() << " (bound " << result.bound()
                               << ") at " << result.where();
  EXPECT_GT(result.count(), 1000u);
}

INSTANTIATE_TEST_SUITE_P(Parity, Oracle,
                         testing::Values("ppo_paper", "ppo_released", "option2vec_paper",
                                         "option2vec_released", "option2vec_released_dropout",
                                         "dac_onestep_paper", "dac_onestep_released",
                                         "dac_ppo_paper", "dac_ppo_paper_relu", "dac_ppo_released",
                                         "dac_ppo_released_relu", "ahp_ppo_paper",
                                         "ahp_ppo_released", "iopg_paper", "iopg_released",
                                         "ppoc_paper", "ppoc_released", "oc_paper", "oc_released"),
                         [](const auto& info) { return info.param; });

nlohmann::json Paper() { return ReadOracle(kFolder / "option2vec_paper.json"); }

double& First(nlohmann::json& array) {
  return array.at("data").at(0).get_ref<nlohmann::json::number_float_t&>();
}

TEST(OracleComparison, NoticesAPlantedDeviationAndSaysWhere) {
  nlohmann::json file = Paper();
  First(file["forward"]["sigma"]) += 1e-8;
  const Comparison result = CompareOracle(file);
  EXPECT_FALSE(result.Passed());
  EXPECT_EQ(result.where(), "forward.sigma[0,0]");
  EXPECT_NEAR(result.deviation(), 1e-8, 1e-12);
}

TEST(OracleComparison, HoldsUpdatedParametersToTheTighterBound) {
  nlohmann::json file = Paper();
  First(file["adam"]["params"][0]) += 5e-10;
  EXPECT_FALSE(CompareOracle(file).Passed());
}

TEST(OracleComparison, RefusesAnIncompleteFile) {
  for (const char* key : {"forward", "losses", "grads", "adam", "gae"}) {
    nlohmann::json file = Paper();
    file.erase(key);
    EXPECT_THROW(CompareOracle(file), Error) << key;
  }
}

TEST(OracleComparison, RefusesAMissingParameter) {
  nlohmann::json file = Paper();
  file["grads"]["high"].erase(0);
  EXPECT_THROW(CompareOracle(file), Error);
}

TEST(OracleComparison, RefusesAnOptionThatDoesNotExist) {
  nlohmann::json file = Paper();
  file["batch"]["o"]["data"][0] = 4;  // of 0, ..., 3
  EXPECT_THROW(CompareOracle(file), Error);
}

TEST(OracleComparison, RefusesAForeignFile) {
  EXPECT_THROW(OracleFileMethod(nlohmann::json::array()), Error);
  EXPECT_THROW(OracleFileMethod({{"format", "other"}}), Error);
}

}  // namespace
}  // namespace o2v
