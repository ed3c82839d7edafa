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
  for (Stream* stream : {&high, &low}) {
    stream->logp_old.resize(B);
    stream->adv_hat.resize(B);
    stream->ret.resize(B);
  }
}

void Gather(const Batch& all, std::span<const int> rows, Batch& out) {
  const Index S = all.s.rows(), A = all.a.rows();
  const bool has_P = all.P_old.size() > 0, has_stop = !all.stop.empty();
  out.Resize(S, A, static_cast<Index>(rows.size()));
  if (has_P) out.P_old.resize(all.P_old.rows(), out.Size());
  if (has_stop) out.stop.resize(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Index to = static_cast<Index>(i), from = rows[i];
    const std::size_t row = static_cast<std::size_t>(from);
    const Real* s = all.s.data() + from * S;  // short columns: plain loops beat block copies
    const Real* a = all.a.data() + from * A;
    for (Index k = 0; k < S; ++k) out.s(k, to) = s[k];
    for (Index k = 0; k < A; ++k) out.a(k, to) = a[k];
    out.o[i] = all.o[row];
    out.o_prev[i] = all.o_prev[row];
    out.init[i] = all.init[row];
    out.high.logp_old(to) = all.high.logp_old(from);
    out.high.adv_hat(to) = all.high.adv_hat(from);
    out.high.ret(to) = all.high.ret(from);
    out.low.logp_old(to) = all.low.logp_old(from);
    out.low.adv_hat(to) = all.low.adv_hat(from);
    out.low.ret(to) = all.low.ret(from);
    if (has_P) out.P_old.col(to) = all.P_old.col(from);
    if (has_stop) out.stop[i] = all.stop[row];
  }
}

}  // namespace o2v
