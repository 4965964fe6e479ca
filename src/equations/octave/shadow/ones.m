function x = ones(varargin)
  % As the built-in one; where derivatives are taken, an array that can take numbers with derivatives.
  x = builtin('ones', varargin{:});
  global mbverify_depth
  if (mbverify_depth > 0 && isa(x, 'double') && isempty(strfind(evalin('caller', ...
      'mfilename("fullpath")'), '/share/octave/')))
    x = x + 0;
    nought = builtin('zeros', size(x));
    x = mbverify_series(x, nought, nought, 1);
  end
end
