// Sizes of the networks at S = 17, A = 6 (HalfCheetah) against the specification's.

#include <gtest/gtest.h>

#include "algo/setup.h"

namespace o2v {
namespace {

const EnvSpec kHalfCheetah = Sizes(17, 6);

/// Parameters at the method's own widths for HalfCheetah-v2, and then `set`.
Index Count(const std::string& method, Fidelity fidelity, const std::vector<std::string>& set) {
  RunRequest request;
  request.task = "HalfCheetah-v2";
  request.algorithm = method;
  request.fidelity = ToString(fidelity);
  request.seed = 1;
  request.steps = 1;
  request.set = set;
  return CountParams(MakeRunAlgorithm(ResolveRun(request), kHalfCheetah)->Params());
}

TEST(ParamCount, OfPpoIsTheSpecifications) {
  // 2 b(S, h) + (h + 1) A + (h + 1) + A, b(i, h) = i h + h + h h + h; spec 2.2
  EXPECT_EQ(Count("ppo", Fidelity::kPaper, {}), 11085);
  EXPECT_EQ(Count("ppo", Fidelity::kPaper, {"hidden=128"}), 38541);
}

TEST(ParamCount, OfOption2VecIsTheSpecifications) {
  EXPECT_EQ(Count("option2vec", Fidelity::kPaper, {}), 31615);     // spec 2.7
  EXPECT_EQ(Count("option2vec", Fidelity::kReleased, {}), 30598);  // spec 2.6
}

TEST(ParamCount, TheUnusedLayerNormExistsOnlyInTheWhollyReleasedArchitecture) {
  // Initial logits without ReLU have no parameters of their own: the 2 (S + D) = 114 of the unused
  // LayerNorm are the whole difference; spec 2.6 item 9, 2.7.
  EXPECT_EQ(Count("option2vec", Fidelity::kReleased, {"o2v_init_relu=paper"}), 30598 - 114);
  EXPECT_EQ(Count("option2vec", Fidelity::kPaper, {"o2v_init_relu=released"}), 31615);
}

TEST(ParamCount, IsTheAuthorsShareOfAnOptionNetwork) {
  // The option network at h = 128, K = 4: (2 + 2K) b(S, h) + 2 (h K + K) + h (K + 1) + (K + 1) +
  // K ((h A + A) + (h + 1) + A); spec 2.3.
  const Index S = 17, A = 6, K = 4, h = 128, body = (S * h + h) + (h * h + h);
  const Index network = (2 + 2 * K) * body + 2 * (h * K + K) + h * (K + 1) + (K + 1) +
                        K * ((h * A + A) + (h + 1) + A);
  EXPECT_EQ(network, 193473);
  const double share = double(Count("option2vec", Fidelity::kReleased, {})) / double(network);
  EXPECT_NEAR(share, 0.158151, 5e-7);
}

}  // namespace
}  // namespace o2v
