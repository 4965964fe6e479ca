function [value, rate, acceleration] = mbverify_motion(f, q, qd, qdd)
  % Value, rate and acceleration of f(q(1), q(2), …) where q moves with qd and qdd. An f of one
  % argument is called with the vector q.
  global mbverify_depth
  before = mbverify_depth;
  level = max([before, mbverify_level(q), mbverify_level(qd), mbverify_level(qdd)]) + 1;
  mbverify_depth = level;
  try
    result = mbverify_call(f, mbverify_series(column(q), column(qd), 0.5 .* column(qdd), level));
  catch failure
    mbverify_depth = before;
    rethrow(failure);
  end
  mbverify_depth = before;
  if (isa(result, 'mbverify_series') && result.level == level)
    value = result.a;
    rate = result.b;
    acceleration = 2 .* result.c;
  else
    value = result;
    rate = 0 .* result;
    acceleration = rate;
  end
end

function x = column(x)
  x = reshape(x, [], 1);
end
