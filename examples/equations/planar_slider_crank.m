function eq = planar_slider_crank()
  % Motor torque of a planar slider-crank, by virtual work; see planar_slider_crank.py for a sketch.
  eq.mechanism = 'planar_slider_crank';
  eq.commands = {'motor'};
  eq.drives = @(p, motor) motor;
  eq.forces = @forces;
  eq.covers = 'unchecked';
  eq.outputs = {'slider.x', 'm', @slider};
end

function torque = forces(p, q, qd, qdd)
  [~, ~, acceleration, J] = mbverify_motion(@(motor) places(p, motor), q, qd, qdd);
  inertia = [p.m_crank; p.m_crank; p.I_crank; p.m_rod; p.m_rod; p.I_rod; p.m_slider];
  weight = p.g * [0; p.m_crank; 0; 0; p.m_rod; 0; 0];
  torque = J' * (inertia .* acceleration + weight);
end

function c = places(p, motor)  % of whatever has mass, and what turns
  phi = -asin(p.r / p.l * sin(motor));
  x = p.r * cos(motor);
  y = p.r * sin(motor);
  c = [x / 2; y / 2; motor; x + p.l / 2 * cos(phi); y / 2; phi; x + p.l * cos(phi)];
end

function x = slider(p, motor)
  x = p.r * cos(motor) + sqrt(p.l^2 - (p.r * sin(motor))^2);
end
