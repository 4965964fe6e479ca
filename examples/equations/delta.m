function eq = delta()
  % Drive angles and torques of a delta robot, by virtual work.
  %
  % Arm i turns about y of its frame, whose x axis points outwards at an azimuth, by the angle theta
  % below the horizontal. Both rods of a pair point along n, as the platform does not turn.
  eq.mechanism = 'delta';
  eq.commands = {'platform.x', 'platform.y', 'platform.z'};
  eq.drives = @(p, x, y, z) angles(p, [x; y; z]);
  eq.forces = @forces;
  eq.covers = 'unchecked';
end

function R = frame(i)
  c = cos(2 * pi / 3 * (i - 1));
  s = sin(2 * pi / 3 * (i - 1));
  R = [c, -s, 0; s, c, 0; 0, 0, 1];
end

function theta = angles(p, r)
  theta = zeros(3, 1);
  for i = 1:3
    d = frame(i)' * r - [p.R - p.r; 0; 0];  % motor to wrist, in the limb's frame
    reach = hypot(d(1), d(3));
    theta(i) = atan2(-d(3), d(1)) - acos((d' * d + p.L^2 - p.l^2) / (2 * p.L * reach));
  end
end

function c = places(p, r)  % angles, platform, of each limb: the arm's centre, the rods', direction
  theta = angles(p, r);
  c = [theta; r];
  for i = 1:3
    arm = frame(i) * [cos(theta(i)); 0; -sin(theta(i))];
    out = frame(i) * [1; 0; 0];
    elbow = p.R * out + p.L * arm;
    wrist = r + p.r * out;
    c = [c; p.R * out + p.c_arm * arm; (elbow + wrist) / 2; (wrist - elbow) / p.l];
  end
end

function torque = forces(p, q, qd, qdd)
  [~, ~, acceleration, J] = mbverify_motion(@(r) places(p, r), q, qd, qdd);
  limb = [p.m_arm, 2 * p.m_rod, 2 * p.I_rod];
  inertia = [p.I_arm * [1; 1; 1]; kron([p.m_platform, limb, limb, limb]', [1; 1; 1])];
  limb(3) = 0;
  weight = [0; 0; 0; kron([p.m_platform, limb, limb, limb]', [0; 0; p.g])];
  torque = J(1:3, :)' \ (J' * (inertia .* acceleration + weight));
end
