function x = mbverify_solve(f, start)
  % x with f(x(1), x(2), …) = 0 (f of one argument: f(x)), by Newton's method from start; with the
  % derivatives of x by whatever f depends on.
  steps = 50;
  x = reshape(mbverify_value(start), [], 1);
  largest = 1e-300;
  found = false;
  for k = 1:steps
    [move, failed] = newton(f, x);
    if (failed)
      mbverify_unreachable('solve: singular on the way to a root');
    end
    x = x - move;
    step = max(abs(move));
    if (~isfinite(step))
      break
    end
    largest = max([largest; abs(x)]);
    if (step <= 4e-16 * largest)
      found = true;
      break
    end
    if (step <= 1e-9 * largest)  % the next step is round-off
      x = x - newton(f, x);
      found = true;
      break
    end
  end
  if (~found || ~all(isfinite(x)))
    mbverify_unreachable(sprintf('solve: no root after %d steps from [%s]', steps, ...
                                 num2str(reshape(mbverify_value(start), 1, []))));
  end
  % Each step with the same matrix gives one more coefficient of the series.
  J = mbverify_value(mbverify_jacobian(f, x));
  residual = mbverify_call(f, x);
  for k = 1:2 * mbverify_level(residual)
    x = x - J \ reshape(residual, [], 1);
    residual = mbverify_call(f, x);
  end
end

function [move, failed] = newton(f, x)
  residual = reshape(mbverify_value(mbverify_call(f, x)), [], 1);
  J = mbverify_value(mbverify_jacobian(f, x));
  move = x;
  failed = ~(rcond(J) >= eps / 2);
  if (~failed)
    move = J \ residual;
  end
end
