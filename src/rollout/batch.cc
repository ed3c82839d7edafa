#include "rollout/batch.h"

namespace o2v {

void Batch::Resize(Index S, Index A, Index B) {
  if (s.rows() == S && a.rows() == A && s.cols() == B) return;
  s.resize(S, B);
  a.resize(A, B);
  const std::size_t n = static_cast<std::size_t>(B);
  o.resize(n);
  o_prev.resize(n);
  init.resize(n);
  for (StageTargets* targets : {&option, &action}) {
    targets->logp_old.resize(B);
    targets->adv_hat.resize(B);
    targets->ret.resize(B);
  }
}

void Gather(const Batch& all, std::span<const int> rows, Batch& out) {
  const Index B = static_cast<Index>(rows.size());
  const auto entries = [&](const auto& from, auto& to) {
    for (Index i = 0; i < B; ++i) to.data()[i] = from.data()[rows[std::size_t(i)]];
  };
  const auto columns = [&](const Mat& from, Mat& to) {  // short ones: plain loops beat block copies
    const Index n = from.rows();
    for (Index i = 0; i < B; ++i) {
      const Real* column = from.data() + rows[std::size_t(i)] * n;
      for (Index k = 0; k < n; ++k) to(k, i) = column[k];
    }
  };
  out.Resize(all.s.rows(), all.a.rows(), B);
  columns(all.s, out.s);
  columns(all.a, out.a);
  entries(all.o, out.o);
  entries(all.o_prev, out.o_prev);
  entries(all.init, out.init);
  for (auto targets : {&Batch::option, &Batch::action}) {
    const StageTargets& from = all.*targets;
    StageTargets& to = out.*targets;
    entries(from.logp_old, to.logp_old);
    entries(from.adv_hat, to.adv_hat);
    entries(from.ret, to.ret);
  }
  if (all.P_old.size() > 0) {
    out.P_old.resize(all.P_old.rows(), B);
    columns(all.P_old, out.P_old);
  }
  if (!all.stop.empty()) {
    out.stop.resize(rows.size());
    entries(all.stop, out.stop);
  }
}

}  // namespace o2v
