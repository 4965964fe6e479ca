function [value, rate, acceleration, J] = mbverify_motion(f, q, qd, qdd)
  % Value, rate and acceleration of f(q(1), q(2), …) where q moves with qd and qdd. An f of one
  % argument is called with the vector q. J: the matrix that mbverify_jacobian(f, q) gives.
  global mbverify_depth
  before = mbverify_depth;
  level = max([before, mbverify_level(q), mbverify_level(qd), mbverify_level(qdd)]) + 1;
  mbverify_depth = level;
  try
    b = column(qd);
    if (nargout > 3 && level == 1)  % the columns of J, too
      n = numel(q);
      b = reshape([b, builtin('eye', n)], n, 1, n + 1);
    end
    result = mbverify_call(f, mbverify_series(column(q), b, 0.5 .* column(qdd), level));
  catch failure
    mbverify_depth = before;
    rethrow(failure);
  end
  mbverify_depth = before;
  if (isa(result, 'mbverify_series') && result.level == level)
    value = result.a;
    rate = result.b;
    acceleration = 2 .* result.c;
    if (nargout > 3 && level == 1)
      J = reshape(rate, numel(value), []);
      rate = rate(:, :, 1);
      J = J(:, 2:end);
    end
  else
    value = result;
    rate = 0 .* result;
    acceleration = rate;
  end
  if (nargout > 3 && (level > 1 || ~isa(result, 'mbverify_series') || isempty(J)))
    J = mbverify_jacobian(f, q);
  end
end

function x = column(x)
  x = reshape(x, [], 1);
end
