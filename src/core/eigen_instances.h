// The dense decompositions that several folders use, compiled once (eigen_instances.cc): every file
// that would instantiate one of them again costs the compiler seconds.
#pragma once

#include <Eigen/Dense>

#define MBV_EIGEN_INSTANCES(DECLARATION)                                                           \
  DECLARATION class Eigen::JacobiSVD<Eigen::MatrixXd>;                                             \
  DECLARATION class Eigen::BDCSVD<Eigen::MatrixXd>;                                                \
  DECLARATION class Eigen::HouseholderQR<Eigen::MatrixXd>;                                         \
  DECLARATION class Eigen::ColPivHouseholderQR<Eigen::MatrixXd>;                                   \
  DECLARATION class Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>;                       \
  DECLARATION class Eigen::PartialPivLU<Eigen::MatrixXd>;                                          \
  DECLARATION class Eigen::FullPivLU<Eigen::MatrixXd>;                                             \
  DECLARATION class Eigen::LDLT<Eigen::MatrixXd>;                                                  \
  DECLARATION class Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;                                \
  DECLARATION Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>&                                      \
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>::compute(const EigenBase<Eigen::MatrixXd>&, int); \
  DECLARATION Eigen::ColPivHouseholderQR<Eigen::MatrixXd>&                                         \
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd>::compute(const EigenBase<Eigen::MatrixXd>&);         \
  DECLARATION void Eigen::HouseholderQR<Eigen::MatrixXd>::_solve_impl(const Eigen::VectorXd&,      \
                                                                      Eigen::VectorXd&) const;     \
  DECLARATION void Eigen::ColPivHouseholderQR<Eigen::MatrixXd>::_solve_impl(                       \
      const Eigen::VectorXd&, Eigen::VectorXd&) const;                                             \
  DECLARATION void Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>::_solve_impl(           \
      const Eigen::VectorXd&, Eigen::VectorXd&) const;

MBV_EIGEN_INSTANCES(extern template)
