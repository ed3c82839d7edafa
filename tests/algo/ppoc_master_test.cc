// What PPOC credits its master policy with (spec 4.2 (d), (g)).

#include <gtest/gtest.h>

#include <cmath>

#include "algo/setup.h"

namespace o2v {
namespace {

/// -(1/B) sum omega A ln pi_o on a batch of ours; omega(P, pi, o, o_prev) at states that are not
/// first ones, 1 there.
template <typename Omega>
void ExpectMasterTerm(Fidelity weight, Omega&& omega) {
  const auto algorithm = MakeRunAlgorithm(
      SmallConfig("ppoc", Fidelity::kPaper, {"ppoc_master_weight=" + ToString(weight)}),
      Sizes(5, 3));
  Rng rng(5, "batch");
  for (Param* p : algorithm->Params()) {
    p->value += RandomMat(p->value.rows(), p->value.cols(), rng, 0.5);
  }
  const Index B = 40;
  const Batch batch = RandomBatch(5, 3, 4, B, rng);
  Mat P, pi;
  algorithm->OptionPolicy(batch.s, batch.o_prev, batch.init, P);
  algorithm->OptionPolicy(batch.s, batch.o_prev, std::vector<char>(std::size_t(B), 1), pi);
  double expected = 0;
  for (Index b = 0; b < B; ++b) {
    const std::size_t i = std::size_t(b);
    const int o = batch.o[i], o_prev = batch.o_prev[i];
    const double credit = batch.init[i] ? 1 : omega(double(P(o, b)), double(pi(o, b)), o == o_prev);
    expected -= credit * double(batch.action.adv_hat(b)) * std::log(double(pi(o, b))) / double(B);
  }
  EXPECT_NEAR(algorithm->Loss(0, batch, nullptr).master, expected, 1e-5);
}

TEST(PpocMaster, IsCreditedByThePosteriorOfASwitch) {
  ExpectMasterTerm(Fidelity::kPaper, [](double P, double pi, bool same) {
    if (!same) return 1.0;                   // only the master can have chosen another option
    const double beta = (1 - P) / (1 - pi);  // P = 1 - beta + beta pi
    return beta * pi / P;
  });
}

TEST(PpocMaster, IsAlwaysCreditedInReleased) {
  ExpectMasterTerm(Fidelity::kReleased, [](double, double, bool) { return 1.0; });
}

}  // namespace
}  // namespace o2v
