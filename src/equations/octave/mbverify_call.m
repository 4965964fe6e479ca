function result = mbverify_call(f, q)
  % f(q(1), q(2), …), or f(q) of a function of one argument.
  n = numel(q);
  if (nargin(f) == 1)
    result = f(q);
  elseif (isa(q, 'mbverify_series'))
    arguments = cell(1, n);
    for k = 1:n
      arguments{k} = q(k);
    end
    result = f(arguments{:});
  else
    arguments = num2cell(q);
    result = f(arguments{:});
  end
end
