function y = acosh(x)
  % As the built-in one, but of real numbers there is no complex result.
  bad = x < 1;
  if (any(bad(:)) && isreal(x) && isempty(strfind(evalin('caller', ...
      'mfilename("fullpath")'), '/share/octave/')))
    error('mbverify:unreachable', 'acosh of %g', x(bad)(1));
  end
  y = builtin('acosh', x);
end
