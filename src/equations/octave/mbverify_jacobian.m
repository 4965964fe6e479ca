function J = mbverify_jacobian(f, q)
  % Matrix of the derivatives of f(q(1), q(2), …): a row per element that f gives (matrices column
  % by column), a column per element of q. An f of one argument is called with the vector q.
  global mbverify_depth
  before = mbverify_depth;
  level = max([before, mbverify_level(q)]) + 1;
  mbverify_depth = level;
  n = numel(q);
  q = reshape(q, [], 1);
  columns = cell(1, n);
  nought = builtin('zeros', n, 1);
  try
    if (level == 1)  % all columns at once
      along = reshape(builtin('eye', n) + 0, n, 1, n);
      result = mbverify_call(f, mbverify_series(q, along, nought, 1));
      if (isa(result, 'mbverify_series'))
        J = reshape(result.b, numel(result), []);
        if (size(J, 2) < n)
          J = repmat(J, 1, n);  % depends on nothing
        end
      else
        J = builtin('zeros', numel(result), n);
      end
      mbverify_depth = before;
      return
    end
    for k = 1:n
      along = nought;
      along(k) = 1;
      result = mbverify_call(f, mbverify_series(q, along, nought, level));
      if (isa(result, 'mbverify_series') && result.level == level)
        columns{k} = reshape(result.b, [], 1);
      else
        columns{k} = builtin('zeros', numel(result), 1);
      end
    end
  catch failure
    mbverify_depth = before;
    rethrow(failure);
  end
  mbverify_depth = before;
  J = [columns{:}];
end
