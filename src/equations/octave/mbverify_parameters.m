classdef mbverify_parameters
  % The model's parameters as a structure that notes which were read (mbverify_read, a global).
  properties
    values
  end

  methods
    function p = mbverify_parameters(values)
      p.values = values;
    end

    function x = subsref(p, index)
      global mbverify_read
      name = index(1).subs;
      if (~strcmp(index(1).type, '.'))
        error('mbverify:parameters', 'parameters are read by name: p.NAME');
      end
      if (~isfield(p.values, name))
        error('mbverify:parameters', 'the model has no parameter ''%s''', name);
      end
      mbverify_read.(name) = true;
      x = p.values.(name);
      if (numel(index) > 1)
        x = subsref(x, index(2:end));
      end
    end

    function p = subsasgn(p, index, x)
      p.values = subsasgn(p.values, index, x);  % of the function's own copy
    end

    function t = isstruct(~)
      t = true;
    end

    function names = fieldnames(p)
      names = fieldnames(p.values);
    end

    function t = isfield(p, names)
      global mbverify_read
      t = isfield(p.values, names);
      names = cellstr(names);
      for name = names(t)(:).'
        mbverify_read.(name{1}) = true;
      end
    end
  end
end
