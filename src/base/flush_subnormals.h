#pragma once
// Arithmetic without subnormal numbers.

#ifdef __SSE__
#include <xmmintrin.h>
#endif

namespace o2v {

/// While it lives, results of this thread below the smallest normal number (1e-38 as float) become
/// zero, and such operands are taken for zero: processors compute with them many times slower. x86
/// only; elsewhere nothing changes.
class FlushSubnormals {
 public:
#ifdef __SSE__
  FlushSubnormals() : before_(_mm_getcsr()) { _mm_setcsr(before_ | kFlushToZero | kZeroOperands); }
  ~FlushSubnormals() { _mm_setcsr(before_); }
#else
  FlushSubnormals() = default;
  ~FlushSubnormals() {}
#endif
  FlushSubnormals(const FlushSubnormals&) = delete;
  FlushSubnormals& operator=(const FlushSubnormals&) = delete;

#ifdef __SSE__
 private:
  // Bits of MXCSR. Source: Intel 64 and IA-32 Architectures Software Developer's Manual, 10.2.3.
  static constexpr unsigned kFlushToZero = 1u << 15, kZeroOperands = 1u << 6;
  unsigned before_;
#endif
};

}  // namespace o2v
