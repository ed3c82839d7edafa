#pragma once
// Matrix products of small matrices, most of what learning costs.

#include "base/types.h"

namespace o2v {

// C must not share memory with A or B. Set overwrites C, Add adds to it; t marks a transposed
// factor.

/// C (m, n) = A (m, k) B (k, n).
void SetAB(const ConstMatRef& A, const ConstMatRef& B, MatRef C);
void AddAB(const ConstMatRef& A, const ConstMatRef& B, MatRef C);
/// C (m, n) = A (m, k) B^T, B (n, k).
void SetABt(const ConstMatRef& A, const ConstMatRef& B, MatRef C);
void AddABt(const ConstMatRef& A, const ConstMatRef& B, MatRef C);
/// C (m, n) = A^T B, A (k, m), B (k, n).
void SetAtB(const ConstMatRef& A, const ConstMatRef& B, MatRef C);
void AddAtB(const ConstMatRef& A, const ConstMatRef& B, MatRef C);

}  // namespace o2v
