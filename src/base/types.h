#pragma once
// Scalar, matrix and vector types of the whole library.

#include <Eigen/Core>
#include <vector>

namespace o2v {

/// Scalar of networks and batches: float in the program (as the reference), double in the
/// gradient-check build (-DO2V_DOUBLE). Physics, statistics and returns are double in both.
#ifdef O2V_DOUBLE
using Real = double;
#else
using Real = float;
#endif

/// Column-major; a batch is columns: x is (features, B), so that one sample is contiguous.
using Mat = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using Vec = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using MatD = Eigen::MatrixXd;
using VecD = Eigen::VectorXd;

using ConstMatRef = Eigen::Ref<const Mat>;
using MatRef = Eigen::Ref<Mat>;

using Index = Eigen::Index;

}  // namespace o2v
