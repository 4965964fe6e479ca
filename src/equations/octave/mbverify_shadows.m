function mbverify_shadows(folder)
  % Writes functions that stand in place of built-in ones into a folder:
  % * where derivatives are taken, zeros, ones and eye give arrays that can take numbers with
  %   derivatives (Octave cannot assign these to elements of plain arrays);
  % * roots, logarithms and arcs of real numbers are real, or end the computation;
  % * what programs print that the file starts goes where its own prints go;
  % * rows of plain numbers in a matrix with others that carry derivatives: Octave asks for horzcat.
  % Octave's own functions, which may count on the built-in ones, get these.
  octaves_own = ['isempty(strfind(evalin(''caller'', ''mfilename("fullpath")''), ', ...
                 '''/share/octave/''))'];
  for name = {'zeros', 'ones', 'eye'}
    write(folder, name{1}, { ...
      'function x = NAME(varargin)'
      '  x = builtin(''NAME'', varargin{:});'
      '  global mbverify_depth'
      ['  if (mbverify_depth > 0 && isa(x, ''double'') && ', octaves_own, ')']
      '    x = x + 0;'
      '    nought = builtin(''zeros'', size(x));'
      '    x = mbverify_series(x, nought, nought, 1);'
      '  end'
      'end'});
  end
  bad = {'sqrt', 'x < 0'; 'log', 'x <= 0'; 'log10', 'x <= 0'; 'asin', 'abs(x) > 1'; ...
         'acos', 'abs(x) > 1'; 'acosh', 'x < 1'; 'atanh', 'abs(x) >= 1'};
  for k = 1:size(bad, 1)
    write(folder, bad{k, 1}, { ...
      'function y = NAME(x)'
      ['  bad = ', bad{k, 2}, ';']
      ['  if (any(bad(:)) && isreal(x) && ', octaves_own, ')']
      '    x = x(bad);'
      '    error(''mbverify:unreachable'', ''NAME of %g'', x(1));'
      '  end'
      '  y = builtin(''NAME'', x);'
      'end'});
  end
  write(folder, 'system', { ...
    'function [status, text] = NAME(command, varargin)'
    '  if (nargout > 1 || nargin > 1)'
    '    [status, text] = builtin(''NAME'', command, varargin{:});'
    '  else'
    '    [status, text] = builtin(''NAME'', command, true);'
    '    puts(text);'
    '  end'
    'end'});
  for kind = {'double', 'logical'}
    own = fullfile(folder, ['@', kind{1}]);
    mkdir(own);
    write(own, 'horzcat', { ...
      'function x = NAME(varargin)'
      '  x = builtin(''NAME'', varargin{:});'
      'end'});
  end
end

function write(folder, name, lines)
  id = fopen(fullfile(folder, [name, '.m']), 'w');
  fputs(id, strrep(strjoin(lines.', "\n"), 'NAME', name));
  fputs(id, "\n");
  fclose(id);
end
