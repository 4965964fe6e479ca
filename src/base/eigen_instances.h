// The decompositions that several folders use, compiled once (eigen_instances.cc): every file that
// would instantiate one of them again costs the compiler seconds. The argument must be of the
// matrix's own type: of an expression they are instantiated anew.
#pragma once

#include <fmt/format.h>
#include <Eigen/Dense>

namespace mbv::internal {
using Matrix6d = Eigen::Matrix<double, 6, 6>;
}

#define MBV_EIGEN_OF_SYMMETRIC(DECLARATION, MATRIX)  \
  DECLARATION Eigen::SelfAdjointEigenSolver<MATRIX>& \
  Eigen::SelfAdjointEigenSolver<MATRIX>::compute(const EigenBase<MATRIX>&, int);

#define MBV_EIGEN_INSTANCES(DECLARATION)                                                         \
  DECLARATION struct Eigen::internal::general_matrix_vector_product<                             \
      long, double, Eigen::internal::const_blas_data_mapper<double, long, 1>, 1, false, double,  \
      Eigen::internal::const_blas_data_mapper<double, long, 0>, false, 0>;                       \
  DECLARATION class Eigen::JacobiSVD<Eigen::MatrixXd>;                                           \
  DECLARATION class Eigen::BDCSVD<Eigen::MatrixXd>;                                              \
  DECLARATION class Eigen::HouseholderQR<Eigen::MatrixXd>;                                       \
  DECLARATION class Eigen::ColPivHouseholderQR<Eigen::MatrixXd>;                                 \
  DECLARATION class Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>;                     \
  DECLARATION void Eigen::FullPivLU<Eigen::MatrixXd>::computeInPlace();                          \
  DECLARATION void Eigen::PartialPivLU<mbv::internal::Matrix6d>::compute();                      \
  DECLARATION Eigen::LDLT<Eigen::MatrixXd>& Eigen::LDLT<Eigen::MatrixXd>::compute(               \
      const EigenBase<Eigen::MatrixXd>&);                                                        \
  DECLARATION void Eigen::LDLT<Eigen::MatrixXd>::_solve_impl_transposed<true>(                   \
      const Eigen::VectorXd&, Eigen::VectorXd&) const;                                           \
  DECLARATION void Eigen::LDLT<Eigen::MatrixXd>::_solve_impl_transposed<true>(                   \
      const Eigen::MatrixXd&, Eigen::MatrixXd&) const;                                           \
  DECLARATION Eigen::EigenSolver<Eigen::MatrixXd>& Eigen::EigenSolver<Eigen::MatrixXd>::compute( \
      const EigenBase<Eigen::MatrixXd>&, bool);                                                  \
  MBV_EIGEN_OF_SYMMETRIC(DECLARATION, Eigen::MatrixXd)                                           \
  MBV_EIGEN_OF_SYMMETRIC(DECLARATION, Eigen::Matrix3d)                                           \
  MBV_EIGEN_OF_SYMMETRIC(DECLARATION, mbv::internal::Matrix6d)                                   \
  DECLARATION Eigen::ColPivHouseholderQR<Eigen::MatrixXd>&                                       \
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd>::compute(const EigenBase<Eigen::MatrixXd>&);       \
  DECLARATION void Eigen::HouseholderQR<Eigen::MatrixXd>::_solve_impl(const Eigen::VectorXd&,    \
                                                                      Eigen::VectorXd&) const;   \
  DECLARATION void Eigen::ColPivHouseholderQR<Eigen::MatrixXd>::_solve_impl(                     \
      const Eigen::VectorXd&, Eigen::VectorXd&) const;                                           \
  DECLARATION void Eigen::ColPivHouseholderQR<Eigen::MatrixXd>::_solve_impl(                     \
      const Eigen::MatrixXd&, Eigen::MatrixXd&) const;                                           \
  DECLARATION void Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>::_solve_impl(         \
      const Eigen::VectorXd&, Eigen::VectorXd&) const;                                           \
  DECLARATION void Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>::_solve_impl(         \
      const Eigen::MatrixXd&, Eigen::MatrixXd&) const;                                           \
  DECLARATION void                                                                               \
  Eigen::HouseholderSequence<Eigen::MatrixXd, Eigen::VectorXd>::applyThisOnTheLeft(              \
      Eigen::MatrixXd&, Eigen::VectorXd&, bool) const;

MBV_EIGEN_INSTANCES(extern template)

namespace mbv {
/// The square orthogonal factor Q.
[[nodiscard]] Eigen::MatrixXd OrthogonalFactor(
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd>& qr);
}  // namespace mbv

// fmt's own formatting into buffers, compiled once as well: every file that calls
// fmt::format_to would instantiate it again.

#define MBV_FORMAT_INSTANCES(DECLARATION)                                          \
  DECLARATION void fmt::detail::vformat_to(buffer<char>&, basic_string_view<char>, \
                                           basic_format_args<buffer_context<char>>, locale_ref);

MBV_FORMAT_INSTANCES(extern template)
