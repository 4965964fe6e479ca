function eq = planar_slider_crank()
  % Motor torque of a planar slider-crank, by virtual work; see planar_slider_crank.py for a sketch.
  eq.mechanism = 'planar_slider_crank';
  eq.commands = {'motor'};
  eq.drives = @(p, motor) motor;
  eq.forces = @forces;
  eq.covers = @covers;
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

function stated = covers(p)  % what the equations take for granted; NaN: of no influence
  stated = {'gravity', [0, -p.g, NaN]; ...
            'crank.mass', p.m_crank; 'crank.com', [p.r / 2, 0, NaN]; ...
            'crank.inertia', [NaN, NaN, p.I_crank]; ...
            'rod.mass', p.m_rod; 'rod.com', [p.l / 2, 0, NaN]; ...
            'rod.inertia', [NaN, NaN, p.I_rod]; 'slider.mass', p.m_slider; ...
            'motor.on_parent', [0, 0, 0]; 'pin.on_parent', [p.r, 0, 0]; ...
            'wrist.on_parent', [p.l, 0, 0]; 'guide.on_parent', [0, 0, 0]; 'guide.axis', [1, 0, 0]};
end

function x = slider(p, motor)
  x = p.r * cos(motor) + sqrt(p.l^2 - (p.r * sin(motor))^2);
end
