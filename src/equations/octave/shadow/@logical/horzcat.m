function x = horzcat(varargin)
  % A row of plain numbers in a matrix with others that carry derivatives: Octave asks for this.
  x = builtin('horzcat', varargin{:});
end
