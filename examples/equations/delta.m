function eq = delta()
  % Drive angles and torques of a delta robot, by virtual work; the three limbs at once.
  %
  % Arm i turns in the plane of z and of the direction u_i outwards, by the angle theta below the
  % horizontal. Both rods of a pair point along n, as the platform does not turn.
  eq.mechanism = 'delta';
  eq.commands = {'platform.x', 'platform.y', 'platform.z'};
  eq.drives = @(p, x, y, z) angles(p, [x; y; z]);
  eq.forces = @forces;
  eq.covers = 'unchecked';
end

function [u, t] = directions()  % outwards, and along the motors' axes, in columns
  azimuth = [0, 2 * pi / 3, -2 * pi / 3];
  u = [cos(azimuth); sin(azimuth); 0, 0, 0];
  t = [-sin(azimuth); cos(azimuth); 0, 0, 0];
end

function theta = angles(p, r)
  [u, t] = directions();
  out = u' * r - (p.R - p.r);  % from motor to wrist: outwards, along the axis, and z
  along = t' * r;
  z = r(3);
  cosine = (out.^2 + along.^2 + z^2 + p.L^2 - p.l^2) ./ (2 * p.L * hypot(out, z));
  theta = atan2(-z, out) - acos(cosine);
end

function c = places(p, r)  % angles, platform; the arms' and the rods' centres, directions of rods
  u = directions();
  theta = angles(p, r);
  arm = u .* cos(theta)' - [0; 0; 1] * sin(theta)';
  elbow = p.R * u + p.L * arm;
  wrist = r + p.r * u;
  limbs = [p.R * u + p.c_arm * arm, (elbow + wrist) / 2, (wrist - elbow) / p.l];
  c = [theta; r; limbs(:)];
end

function torque = forces(p, q, qd, qdd)
  [~, ~, acceleration, J] = mbverify_motion(@(r) places(p, r), q, qd, qdd);
  three = [1; 1; 1];
  mass = [p.m_platform; p.m_arm * three; 2 * p.m_rod * three; 0 * three];
  inertia = [p.m_platform; p.m_arm * three; 2 * p.m_rod * three; 2 * p.I_rod * three];
  inertia = [p.I_arm * three; kron(inertia, three)];
  weight = [0 * three; kron(mass, [0; 0; p.g])];
  torque = J(1:3, :)' \ (J' * (inertia .* acceleration + weight));
end
