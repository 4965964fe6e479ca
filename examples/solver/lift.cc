// Forces of a Stewart platform's legs while it is lifted from its home pose at 2 m/s².
#include <mbverify/solver.h>

#include <iostream>

int main() {
  const mbv::Model model = mbv::Model::Load("stewart");
  mbv::Solver solver(model, {"platform.x", "platform.y", "platform.z", "platform.roll",
                             "platform.pitch", "platform.yaw"});
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(6), lift = 2.0 * Eigen::VectorXd::Unit(6, 2);
  mbv::Forces forces;
  const mbv::Status status = solver.InverseDynamics(solver.home(), rest, lift, {}, &forces);
  if (!status.ok()) std::cerr << status.message << '\n';
  std::cout << forces.drives.transpose() << '\n';
  return status.ok() ? 0 : 1;
}
