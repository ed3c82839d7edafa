// Sizes of the networks at S = 17, A = 6 (HalfCheetah) against the specification's.

#include <gtest/gtest.h>

#include "algo/setup.h"
#include "report/param_table.h"

namespace o2v {
namespace {

const EnvSpec kHalfCheetah = Sizes(17, 6);

struct Size {
  Index counted, used;  // all; those that some stage's loss can reach
  bool operator==(const Size&) const = default;
};

void PrintTo(const Size& size, std::ostream* out) {
  *out << size.counted << ", used " << size.used;
}

/// Parameters at the method's own widths for HalfCheetah-v2, and then `set`.
Size Count(const std::string& method, Fidelity fidelity, const std::vector<std::string>& set) {
  const auto algorithm =
      MakeRunAlgorithm(ConfigFor("HalfCheetah-v2", method, fidelity, set), kHalfCheetah);
  return {CountParams(algorithm->Params()), CountUsed(*algorithm)};
}

constexpr Fidelity kPaper = Fidelity::kPaper, kReleased = Fidelity::kReleased;

TEST(ParamCount, OfPpoIsTheSpecifications) {
  // 2 b(S, h) + (h + 1) A + (h + 1) + A, b(i, h) = i h + h + h h + h; spec 2.2
  EXPECT_EQ(Count("ppo", kPaper, {}), (Size{11085, 11085}));
  EXPECT_EQ(Count("ppo", kPaper, {"hidden=128"}), (Size{38541, 38541}));
}

TEST(ParamCount, OfTheOptionNetworkIsTheSpecifications) {
  for (const char* method : {"dac_ppo", "ppoc", "iopg", "ahp_ppo", "oc"}) {
    for (const Fidelity fidelity : {kPaper, kReleased}) {
      EXPECT_EQ(Count(method, fidelity, {"hidden=64"}).counted, 55809) << method;
      EXPECT_EQ(Count(method, fidelity, {"hidden=128"}).counted, 193473) << method;
    }
  }
}

TEST(ParamCount, LeavesOutTheHeadsAndTheMasterThatAMethodNeverUses) {
  for (const Fidelity fidelity : {kPaper, kReleased}) {
    for (const char* method : {"dac_ppo", "ppoc"}) {
      EXPECT_EQ(Count(method, fidelity, {}).used, 55809 - 325) << method;  // u
    }
    EXPECT_EQ(Count("ahp_ppo", fidelity, {}).used, 55809 - 260);  // q
    EXPECT_EQ(Count("oc", fidelity, {}).used, 55809 - 5897);      // u, master's body and head
  }
}

TEST(ParamCount, KeepsTheTerminationsOfIopgWhoseGradientIsZeroWhereEveryStepIsAFirstOne) {
  for (const Fidelity fidelity : {kPaper, kReleased}) {
    EXPECT_EQ(Count("iopg", fidelity, {}).used, 55809 - 325);  // u; spec 2.3
  }
}

TEST(ParamCount, OfReleasedDacOneStepIsTheSpecifications) {  // spec 2.4
  EXPECT_EQ(Count("dac_onestep", kReleased, {"hidden=64"}), (Size{57321, 35488}));
  EXPECT_EQ(Count("dac_onestep", kReleased, {"hidden=128"}).counted, 195049);
}

TEST(ParamCount, OfRecommendedDacOneStepIsTheSpecifications) {  // spec 2.5
  EXPECT_EQ(Count("dac_onestep", kPaper, {}), (Size{34232, 34232}));
  EXPECT_EQ(Count("dac_onestep", kPaper, {"hidden=128"}), (Size{117560, 117560}));
  // The index as a number, one more input, and 2 (S + 1) of the LayerNorm that comes with it.
  const Index with_norm = 34040 + 2 * (17 + 1);
  EXPECT_EQ(Count("dac_onestep", kPaper, {"onestep_index=released"}), (Size{with_norm, with_norm}));
}

TEST(ParamCount, OfOption2VecIsTheSpecifications) {
  EXPECT_EQ(Count("option2vec", kPaper, {}), (Size{31615, 31615}));     // spec 2.7
  EXPECT_EQ(Count("option2vec", kReleased, {}), (Size{30598, 30484}));  // spec 2.6, item 9
}

TEST(ParamCount, TheUnusedLayerNormExistsOnlyInTheWhollyReleasedArchitecture) {
  // Initial logits without ReLU have no parameters of their own: the 2 (S + D) = 114 of the unused
  // LayerNorm are the whole difference; spec 2.6 item 9, 2.7.
  EXPECT_EQ(Count("option2vec", kReleased, {"o2v_init_relu=paper"}), (Size{30484, 30484}));
  EXPECT_EQ(Count("option2vec", kPaper, {"o2v_init_relu=released"}), (Size{31615, 31615}));
}

TEST(ParamCount, IsTheAuthorsShareOfAnOptionNetwork) {
  const double ours = double(Count("option2vec", kReleased, {}).counted);
  EXPECT_NEAR(ours / double(Count("dac_ppo", kReleased, {"hidden=128"}).counted), 0.158151, 5e-7);
  EXPECT_NEAR(ours / double(Count("dac_ppo", kReleased, {"hidden=64"}).counted), 0.548, 5e-4);
}

}  // namespace
}  // namespace o2v
