function mbverify_host(path)
  % Answers mbverify's calls about one file of equations: a JSON text a line on standard input, one
  % a line on standard output. What the file prints goes to standard error.
  %
  % The file is a function without arguments that gives a structure of handles:
  %
  %   function eq = my_delta()
  %     eq.mechanism = 'my_delta';                       % the name in model.yaml
  %     eq.commands = {'platform.x', 'platform.y', 'platform.z'};
  %     eq.drives = @drives;                             % drives(p, x, y, z): all positions
  %     eq.forces = @forces;                             % forces(p, q, qd, qdd) or (…, load)
  %     eq.outputs = {'slider.x', 'm', @slider};         % rows: channel, unit, function of p, x, …
  %     eq.rates = @rates; eq.jacobian = @jac;           % rates(p, q, qd), jac(p, x, y, z)
  %     eq.covers = @covers;                             % or 'unchecked'
  %     eq.states = struct('model', …, 'coordinates', {{…}}, …);
  %     eq.equations = {struct('number', '(3)', 'gives', 'leg1', 'function', @eq3, …)};
  %   end
  %
  % Several forms in one file: a cell of such structures. SI units and radians. p is a structure of
  % the model's parameters (at the first calls one that notes which are read); q, qd, qdd are
  % columns; load is a structure array (loads_of, below).
  %
  % drives and outputs are called with numbers that carry derivatives (mbverify_series). Those do
  % not go into elements of arrays of plain numbers: v = [1; 2]; v(1) = x fails; v = zeros(2, 1);
  % v(1) = x, v = [x; 2] and cells work. `for e = v`, arrayfun, interp1 and functions that ask for
  % the class double do not take them.
  global mbverify_depth mbverify_read
  page_screen_output(false);
  beep_on_error(false);
  warning('off', 'Octave:shadowed-function');
  warning('off', 'Octave:possible-matlab-short-circuit-operator');
  own = fileparts(mfilename('fullpath'));
  % Started in the folder of these files, which is then mbverify's own, it leaves its files there.
  if (strcmp(canonicalize_file_name(own), canonicalize_file_name(pwd())))
    shadows = tempname(own);
  else
    shadows = tempname();
  end
  mkdir(shadows);
  tidy = onCleanup(@() remove(shadows));
  mbverify_shadows(shadows);
  addpath(shadows);
  host.scratch = shadows;
  % A solution by least squares in place of none is no answer.
  warning('error', 'Octave:singular-matrix');
  warning('error', 'Octave:nearly-singular-matrix');

  host.path = canonical(path);
  host.own = {[own, '/'], [shadows, '/']};
  host.file = struct();
  host.parameters = struct();
  addpath(fileparts(host.path), '-end');

  while (true)
    try
      line = input('', 's');  % fgetl would wait for the line after it
    catch
      break  % the end of the input
    end
    mbverify_depth = 0;
    [printed, host, answer] = guarded(host, line);
    if (~isempty(printed))
      fputs(stderr, printed);
    end
    fputs(stdout, [answer, "\n"]);
    fflush(stdout);
  end
end

function remove(folder)
  confirm_recursive_rmdir(false, 'local');
  rmdir(folder, 's');
end

function [printed, host, answer] = guarded(host, line)
  printed = evalc('[host, answer] = answered(host, line);');
end

function [host, text] = answered(host, line)
  try
    call = jsondecode(line, 'makeValidName', false);
    switch (call.do)
      case 'load'
        host = load_file(host, host.path);
        text = json(host.file.info);
      case 'set'
        host = set_parameters(host, call.parameters);
        text = '{}';
      case 'read'
        text = read_names(host);
      case 'covers'
        text = covers(host, call.form + 1);
      case 'drives'
        [host, text] = tracked(host, 'drives', call.form + 1, call, @drives_text);
      case 'sample'
        [host, text] = tracked(host, 'sample', call.form + 1, call, @sample_text);
      case 'equation'
        [host, text] = tracked(host, 'equation', call.index + 1, call, @equation_text);
      case 'try_source'
        text = try_source(host, call);
      case 'try_form'
        text = try_form(host, call);
      otherwise
        error('mbverify:host', 'there is no call ''%s''', call.do);
    end
  catch failure
    text = json(struct('error', described(failure, host)));
  end
end

% The file.

function host = load_file(host, path)
  [folder, name] = fileparts(path);
  text = fileread(path);
  host.file = struct();
  if (~isvarname(name))
    error('mbverify:host', ...
          '''%s'' is no name of a function: letters, digits and _ alone', name);
  end
  % The file and its edited texts have one name: the folder of the one that is meant comes first, and
  % what was read before is forgotten.
  persistent first
  if (~strcmp(first, folder))
    addpath(folder);
    first = folder;
  end
  clear(name);
  given = feval(name);
  if (isstruct(given))
    given = num2cell(given);
  end
  if (~iscell(given) || ~all(cellfun(@isstruct, given)))
    error('mbverify:host', '%s gives a %s; a structure is wanted', name, class(given));
  end
  source = functions_of(text);
  forms = {};
  equations = {};
  host.file.forms = {};
  host.file.equations = {};
  states = struct();
  for k = 1:numel(given)
    eq = given{k};
    if (isfield(eq, 'drives') || isfield(eq, 'mechanism'))
      [form, info] = read_form(eq, source, text);
      host.file.forms{end + 1} = form;
      forms{end + 1} = info;
    end
    if (isfield(eq, 'equations'))
      entries = eq.equations;
      if (isstruct(entries))
        entries = num2cell(entries);
      end
      for n = 1:numel(entries)
        [entry, info] = read_equation(entries{n}, source, text);
        host.file.equations{end + 1} = entry;
        equations{end + 1} = info;
      end
    end
    if (isfield(eq, 'states'))
      states = read_states(eq.states);
    end
  end
  host.file.info = struct('forms', {forms}, 'states', states, 'equations', {equations});
  host.file.info.forms = forms;
  host.file.info.equations = equations;
end

function [form, info] = read_form(eq, source, text)
  known = {'mechanism', 'commands', 'drives', 'forces', 'outputs', 'rates', 'jacobian', ...
           'covers', 'states', 'equations'};
  for name = fieldnames(eq).'
    if (~any(strcmp(name{1}, known)))
      error('mbverify:host', 'there is no field ''%s''; known are %s', name{1}, ...
            strjoin(known, ', '));
    end
  end
  for name = {'mechanism', 'drives'}
    if (~isfield(eq, name{1}))
      error('mbverify:host', 'the structure has no field ''%s''', name{1});
    end
  end
  form.drives = eq.drives;
  place = located(eq.drives, source);
  if (isfield(eq, 'commands'))
    form.commands = reshape(cellstr(eq.commands), 1, []);
  else
    form.commands = place.arguments(2:end);
  end
  form.parts = struct();
  for name = {'covers', 'forces', 'jacobian', 'rates'}
    part = name{1};
    if (isfield(eq, part) && is_function(eq.(part)))
      form.parts.(part) = eq.(part);
    elseif (isfield(eq, part) && ~(strcmp(part, 'covers') && ischar(eq.covers)))
      error('mbverify:host', '''%s'' is a %s; a function handle is wanted', part, class(eq.(part)));
    end
  end
  form.takes_loads = isfield(form.parts, 'forces') && nargin(form.parts.forces) > 4;
  form.outputs = {};
  if (isfield(eq, 'outputs'))
    form.outputs = eq.outputs;
    if (~iscell(form.outputs) || size(form.outputs, 2) ~= 3)
      error('mbverify:host', '''outputs'' has rows of channel, unit, function');
    end
  end
  outputs = {};
  for k = 1:size(form.outputs, 1)
    outputs{k} = struct('channel', form.outputs{k, 1}, 'unit', form.outputs{k, 2});
  end
  info.mechanism = eq.mechanism;
  info.commands = form.commands;
  info.line = place.line;
  at = regexp(text, '\.drives\s*=|''drives''', 'once');
  if (place.line == 0 && ~isempty(at))  % an anonymous function
    info.line = 1 + sum(text(1:at) == "\n");
  end
  info.unchecked = isfield(eq, 'covers') && ischar(eq.covers) && strcmp(eq.covers, 'unchecked');
  info.parts = fieldnames(form.parts).';
  info.takes_loads = form.takes_loads;
  info.outputs = outputs;
end

function [entry, info] = read_equation(eq, source, text)
  known = {'number', 'gives', 'function', 'given', 'each', 'printed', 'corrected', ...
           'corrected_text', 'note', 'unit', 'approximation', 'erratum'};
  for name = fieldnames(eq).'
    if (~any(strcmp(name{1}, known)))
      error('mbverify:host', 'equation: there is no field ''%s''; known are %s', name{1}, ...
            strjoin(known, ', '));
    end
  end
  place = located(eq.function, source);
  if (place.line == 0)
    place = written_at(place, eq.number, text);
  end
  entry.function = eq.function;
  entry.arguments = place.arguments(2:end);
  entry.corrected = [];
  at = struct('line', 0, 'end', 0);
  all_arguments = entry.arguments;
  if (isfield(eq, 'corrected') && is_function(eq.corrected))
    entry.corrected = eq.corrected;
    at = located(eq.corrected, source);
    entry.corrected_arguments = at.arguments(2:end);
    if (at.line == 0)
      at = place;
    end
    all_arguments = unique([all_arguments, entry.corrected_arguments], 'stable');
  end
  info.number = eq.number;
  info.gives = eq.gives;
  info.line = place.line;
  info.end = place.end;
  info.corrected_line = at.line;
  info.corrected_end = at.end;
  info.arguments = all_arguments;
  info.has_corrected = ~isempty(entry.corrected);
  info.given = as_map(field_or(eq, 'given', struct()));
  info.each = as_map(field_or(eq, 'each', struct()));
  for k = 1:numel(info.each.values)
    if (~iscell(info.each.values{k}))
      info.each.values{k} = num2cell(reshape(info.each.values{k}, 1, []));
    end
  end
  info.printed = field_or(eq, 'printed', '');
  info.corrected = field_or(eq, 'corrected_text', '');
  if (isfield(eq, 'corrected') && ischar(eq.corrected))
    info.corrected = eq.corrected;
  end
  info.note = field_or(eq, 'note', '');
  info.unit = field_or(eq, 'unit', '');
  info.approximation = field_or(eq, 'approximation', 0);
  info.erratum = field_or(eq, 'erratum', '');
end

function states = read_states(given)
  states.model = given.model;
  states.coordinates = reshape(cellstr(given.coordinates), 1, []);
  for name = {'ranges', 'rates', 'accelerations', 'parameters'}
    states.(name{1}) = as_map(field_or(given, name{1}, struct()));
  end
  states.gravity = [];
  if (isfield(given, 'gravity'))
    states.gravity = num2cell(reshape(given.gravity, 1, []));
  else
    states.gravity = NaN;  % null
  end
  loads = field_or(given, 'loads', {});
  if (isstruct(loads))
    loads = num2cell(loads);
  end
  states.loads = reshape(loads, 1, []);
  states.samples = field_or(given, 'samples', 40);
end

function value = field_or(s, name, other)
  value = other;
  if (isfield(s, name))
    value = s.(name);
  end
end

function t = is_function(f)
  t = isa(f, 'function_handle');
end

% {names; values} of a structure, of rows {name, value; …} or of a containers.Map.
function map = as_map(x)
  map.is_map = true;
  if (isstruct(x))
    map.names = fieldnames(x).';
    map.values = struct2cell(x).';
  elseif (isa(x, 'containers.Map'))
    map.names = keys(x);
    map.values = values(x);
  elseif (iscell(x) && (isempty(x) || size(x, 2) == 2))
    map.names = reshape(x(:, 1), 1, []);
    map.values = reshape(x(:, 2), 1, []);
  else
    error('mbverify:host', 'a %s where names with values are wanted', class(x));
  end
end

% Functions of a text: name, arguments, first and last line.
function found = functions_of(text)
  lines = strsplit(text, "\n", 'CollapseDelimiters', false);
  found = struct('name', {}, 'arguments', {}, 'line', {}, 'end', {});
  for k = 1:numel(lines)
    line = lines{k};
    for n = k + 1:numel(lines)
      if (isempty(regexp(line, '^\s*function.*\.\.\.', 'once')))
        break
      end
      line = [regexprep(line, '\.\.\..*$', ''), lines{n}];
    end
    t = regexp(line, '^\s*function\s+(?:[^=(]*=\s*)?(\w+)\s*(?:\(([^)]*)\))?', ...
               'tokens', 'once');
    if (isempty(t))
      continue
    end
    if (~isempty(found))
      found(end).end = last_of(lines, found(end).line, k - 1);
    end
    arguments = {};
    if (numel(t) > 1 && ~isempty(strtrim(t{2})))
      arguments = strtrim(strsplit(t{2}, ','));
    end
    found(end + 1) = struct('name', t{1}, 'arguments', {arguments}, 'line', k, 'end', numel(lines));
  end
  if (~isempty(found))
    found(end).end = last_of(lines, found(end).line, numel(lines));
  end
end

function last = last_of(lines, first, last)
  while (last > first && (isempty(strtrim(lines{last})) || any(strtrim(lines{last})(1) == '%#')))
    last = last - 1;
  end
end

function place = located(f, source)
  place = struct('line', 0, 'end', 0, 'arguments', {{}});
  if (~is_function(f))
    error('mbverify:host', 'a %s where a function handle is wanted', class(f));
  end
  info = functions(f);
  t = regexp(info.function, '^@\s*\(([^)]*)\)', 'tokens', 'once');
  if (~isempty(t))  % anonymous
    if (~isempty(strtrim(t{1})))
      place.arguments = strtrim(strsplit(t{1}, ','));
    end
    return
  end
  k = find(strcmp({source.name}, info.function), 1);
  if (isempty(k))
    place.arguments = arrayfun(@(n) sprintf('x%d', n), 0:nargin(f) - 1, 'UniformOutput', false);
    return
  end
  place.line = source(k).line;
  place.end = source(k).end;
  place.arguments = source(k).arguments;
end

% Of an anonymous function: from the equation's number to where its brackets end.
function place = written_at(place, number, text)
  at = strfind(text, ['''', number, '''']);
  if (isempty(at))
    place.line = 1;
    place.end = 1;
    return
  end
  at = at(1);
  depth = 0;
  stop = at + numel(number) + 2;
  while (stop < numel(text) && depth >= 0)
    depth = depth + any(text(stop) == '([{') - any(text(stop) == ')]}');
    stop = stop + 1;
  end
  place.line = 1 + sum(text(1:at) == "\n");
  place.end = 1 + sum(text(1:stop - 1) == "\n");
end

% Parameters, and which were read: found out at the first calls of each kind.

function host = set_parameters(host, values)
  global mbverify_read
  mbverify_read = struct();
  if (isempty(values))
    values = struct();
  end
  host.parameters = values;
  host.calls = struct();
end

function [host, text] = tracked(host, kind, number, call, f)
  key = sprintf('%s%d', kind, number);
  count = field_or(host.calls, key, 0);
  if (count < 8)
    host.calls.(key) = count + 1;
    text = f(host, mbverify_parameters(host.parameters), number, call);
  else
    text = f(host, host.parameters, number, call);
  end
end

function text = read_names(host)
  global mbverify_read
  names = sort(fieldnames(mbverify_read)).';
  names = names(isfield(host.parameters, names));
  text = json(struct('names', {names}));
end

% Calls.

function text = covers(host, k)
  form = host.file.forms{k};
  if (isfield(form.parts, 'covers'))
    stated = as_map(form.parts.covers(mbverify_parameters(host.parameters)));
    for n = 1:numel(stated.values)
      value = stated.values{n};
      if (iscell(value))
        value = cellfun(@(x) [x, NaN(1, isempty(x))], value(:).');
      elseif (isempty(value))
        value = NaN;
      end
      value = value.';
      stated.values{n} = num2cell(double(value(:).'));
    end
  else
    stated = as_map(struct());
  end
  text = json(struct('stated', stated));
end

function text = drives_text(host, p, k, call)
  text = ['{', drive_series(host.file.forms{k}, p, series(call)), '}'];
end

function arguments = series(call)
  % Of the commands, each with two derivatives by time.
  global mbverify_depth
  mbverify_depth = 1;
  arguments = cell(1, numel(call.q));
  for n = 1:numel(call.q)
    arguments{n} = mbverify_series(call.q(n), call.qd(n), 0.5 * call.qdd(n), 1);
  end
end

function text = drive_series(form, p, arguments)
  global mbverify_depth
  mbverify_depth = 1;
  given = form.drives(p, arguments{:});
  if (isstruct(given))
    parts = {};
    for name = fieldnames(given).'
      [a, b, c] = coefficients(given.(name{1}));
      parts{end + 1} = sprintf('%s: [%s]', quoted(name{1}), listed([a(1), b(1), c(1)]));
    end
    text = ['"named": {', strjoin(parts, ', '), '}'];
  else
    text = ['"values": [', triples(given), ']'];
  end
end

function text = sample_text(host, p, k, call)
  global mbverify_depth
  form = host.file.forms{k};
  arguments = series(call);
  text = drive_series(form, p, arguments);
  mbverify_depth = 0;
  q = call.q(:);
  qd = call.qd(:);
  qdd = call.qdd(:);
  parts = form.parts;
  if (isfield(parts, 'rates'))
    text = [text, ', "rates": [', listed(numbers(parts.rates(p, q, qd))), ']'];
  end
  if (isfield(parts, 'jacobian'))
    own = num2cell(q);
    J = mbverify_value(parts.jacobian(p, own{:}));
    if (iscell(J))
      J = cell2mat(J);
    end
    if (size(J, 2) ~= numel(q))
      error('mbverify:host', 'jacobian gave %d columns for %d commands', size(J, 2), numel(q));
    end
    text = [text, ', "jacobian_rates": [', listed(numbers(J * qd)), ']'];
  end
  if (isfield(parts, 'forces'))
    if (form.takes_loads)
      given = parts.forces(p, q, qd, qdd, loads_of(call));
    else
      given = parts.forces(p, q, qd, qdd);
    end
    if (isstruct(given))
      entries = {};
      for name = fieldnames(given).'
        entries{end + 1} = sprintf('%s: %s', quoted(name{1}), listed(numbers(given.(name{1}))(1)));
      end
      text = [text, ', "named_forces": {', strjoin(entries, ', '), '}'];
    else
      text = [text, ', "forces": [', listed(numbers(given)), ']'];
    end
  end
  if (~isempty(form.outputs))
    mbverify_depth = 1;
    entries = cell(1, size(form.outputs, 1));
    for n = 1:size(form.outputs, 1)
      f = form.outputs{n, 3};
      [a, b, c] = coefficients(f(p, arguments{:}));
      entries{n} = ['[', listed([a(1), b(1), c(1)]), ']'];
    end
    text = [text, ', "outputs": [', strjoin(entries, ', '), ']'];
    mbverify_depth = 0;
  end
  text = ['{', text, '}'];
end

% A structure array with name, body, axes ("world" or "body"), point (in the body's frame), force
% and moment (about the point), columns of three.
function loads = loads_of(call)
  loads = struct('name', {}, 'body', {}, 'axes', {}, 'point', {}, 'force', {}, 'moment', {});
  if (~isfield(call, 'load') || isempty(call.load))
    return
  end
  given = call.load;
  for k = 1:numel(given)
    entry = given(k);
    if (iscell(entry))
      entry = entry{1};
    end
    loads(k) = struct('name', entry.name, 'body', entry.body, 'axes', entry.axes, ...
                      'point', entry.point(:), 'force', entry.force(:), 'moment', entry.moment(:));
  end
end

function text = equation_text(host, p, k, call)
  global mbverify_depth
  mbverify_depth = 0;
  entry = host.file.equations{k};
  f = entry.function;
  names = entry.arguments;
  if (field_or(call, 'corrected', false))
    f = entry.corrected;
    names = entry.corrected_arguments;
  end
  rows = call.rows;
  if (isempty(rows))
    text = '{"rows": []}';
    return
  end
  values = cell(1, numel(rows));
  for n = 1:numel(rows)
    row = rows(n);
    if (iscell(row))
      row = row{1};
    end
    arguments = cell(1, numel(names));
    for j = 1:numel(names)
      if (~isfield(row, names{j}))
        error('mbverify:host', 'nothing is given for the argument ''%s''', names{j});
      end
      arguments{j} = row.(names{j});
    end
    values{n} = ['[', listed(numbers(f(p, arguments{:}))), ']'];
  end
  text = ['{"rows": [', strjoin(values, ', '), ']}'];
end

function other = load_edited(host, source)
  % An edited text, in a folder of its own.
  folder = fullfile(host.scratch, 'edited');
  if (~exist(folder, 'dir'))
    mkdir(folder);
  end
  [~, name] = fileparts(host.path);
  file = fullfile(folder, [name, '.m']);
  id = fopen(file, 'w');
  fputs(id, source);
  fclose(id);
  other = load_file(host, file);
end

function text = try_form(host, call)
  % Drives' positions or forces of an edited text at many states; errors are part of the answer.
  try
    other = load_edited(host, call.source);
    forces = strcmp(call.part, 'forces');
    rows = call.rows;
    lists = cell(1, numel(rows));
    for k = 1:numel(rows)
      if (iscell(rows))
        row = rows{k};
      else
        row = rows(k);
      end
      if (forces)
        answer = jsondecode(sample_text(other, host.parameters, call.form + 1, row), ...
                            'makeValidName', false);
        values = in_order(answer, 'forces', 'named_forces', call.drives);
      else
        answer = jsondecode(drives_text(other, host.parameters, call.form + 1, row), ...
                            'makeValidName', false);
        values = in_order(answer, 'values', 'named', call.drives);
      end
      lists{k} = ['[', listed(values), ']'];
    end
    text = ['{"rows": [', strjoin(lists, ', '), ']}'];
  catch failure
    text = json(struct('failed', failure.message));
  end
end

function values = in_order(answer, list, map, drives)
  % First numbers of each, in the order of the drives.
  if (isfield(answer, map))
    values = cellfun(@(name) answer.(map).(name)(1), drives);
  elseif (size(answer.(list), 2) == 3 && strcmp(list, 'values'))
    values = answer.(list)(:, 1);
  else
    values = answer.(list);
  end
end

function text = try_source(host, call)
  % It may name whatever is given, not the function's arguments alone.
  try
    other = load_edited(host, with_all_given(host, call));
    text = equation_text(other, host.parameters, call.index + 1, call);
  catch failure
    text = json(struct('failed', failure.message));
  end
end

function text = with_all_given(host, call)
  text = call.source;
  entry = host.file.equations{call.index + 1};
  f = entry.function;
  if (field_or(call, 'corrected', false))
    f = entry.corrected;
  end
  row = call.rows;
  if (iscell(row) && ~isempty(row))
    row = row{1};
  end
  source = functions_of(text);
  k = find(strcmp({source.name}, functions(f).function), 1);
  if (isempty(k) || ~isstruct(row))
    return
  end
  more = setdiff(fieldnames(row).', source(k).arguments);
  more = more(cellfun(@isvarname, more));
  lines = strsplit(text, "\n", 'CollapseDelimiters', false);
  if (~isempty(more) && ~isempty(source(k).arguments))
    given = strjoin([source(k).arguments, more], ', ');
    lines{source(k).line} = regexprep(lines{source(k).line}, '\([^)]*\)', ['(', given, ')'], ...
                                      'once');
    text = strjoin(lines, "\n");
  end
end

% Numbers.

function [a, b, c] = coefficients(x)
  if (iscell(x))
    [a, b, c] = cellfun(@coefficients, reshape(x, 1, []), 'UniformOutput', false);
    a = [a{:}];
    b = [b{:}];
    c = [c{:}];
    return
  end
  if (isa(x, 'mbverify_series'))
    a = mbverify_value(x.a);
    b = mbverify_value(x.b);
    c = mbverify_value(x.c);
  elseif (isfloat(x) || isa(x, 'integer'))
    a = double(x);
    b = builtin('zeros', size(a));
    c = b;
  else
    error('mbverify:host', 'gave a %s where a number is wanted', class(x));
  end
  if (isempty(a))
    error('mbverify:host', 'gave nothing where numbers are wanted');
  end
  if (~isreal(a) || ~isreal(b) || ~isreal(c))
    error('mbverify:unreachable', 'gave complex numbers');
  end
  if (size(a, 1) ~= 1)
    a = a.';
    b = b.';
    c = c.';
    a = a(:).';
    b = b(:).';
    c = c(:).';
  end
end

function x = numbers(x)
  [x, ~, ~] = coefficients(x);
end

function text = triples(x)
  [a, b, c] = coefficients(x);
  text = sprintf('[%.17g, %.17g, %.17g], ', [a; b; c]);
  text = finite_text(text(1:end - 2), [a, b, c]);
end

function text = listed(x)
  text = sprintf('%.17g, ', x);
  text = finite_text(text(1:end - 2), x);
end

% JSON has no number for NaN and the infinite.
function text = finite_text(text, x)
  if (~all(isfinite(x(:))))
    text = regexprep(text, '-?(NaN|Inf)', 'null');
  end
end

function text = json(x)
  if (isstruct(x) && isfield(x, 'is_map'))
    entries = cell(1, numel(x.names));
    for k = 1:numel(x.names)
      entries{k} = [quoted(x.names{k}), ': ', json(x.values{k})];
    end
    text = ['{', strjoin(entries, ', '), '}'];
  elseif (isstruct(x) && numel(x) == 1)
    names = fieldnames(x).';
    entries = cell(1, numel(names));
    for k = 1:numel(names)
      entries{k} = [quoted(names{k}), ': ', json(x.(names{k}))];
    end
    text = ['{', strjoin(entries, ', '), '}'];
  elseif (isstruct(x))
    text = json(num2cell(x));
  elseif (iscell(x))
    text = ['[', strjoin(cellfun(@json, reshape(x, 1, []), 'UniformOutput', false), ', '), ']'];
  elseif (ischar(x))
    text = quoted(x);
  elseif (islogical(x) && numel(x) == 1)
    text = {'false', 'true'}{x + 1};
  elseif (isnumeric(x) && numel(x) == 1)
    text = listed(double(x));
  elseif (isnumeric(x) && (isvector(x) || isempty(x)))
    text = ['[', listed(double(x)), ']'];
  elseif (isnumeric(x))
    rows = cellfun(@(row) ['[', listed(row), ']'], num2cell(double(x), 2).', ...
                   'UniformOutput', false);
    text = ['[', strjoin(rows, ', '), ']'];
  else
    error('mbverify:host', 'a %s cannot be handed over', class(x));
  end
end

function text = quoted(text)
  text = strrep(text, '\', '\\');
  text = strrep(text, '"', '\"');
  text = strrep(text, "\n", '\n');
  text = strrep(text, "\r", '\r');
  text = strrep(text, "\t", '\t');
  text(text < 32 & text >= 0) = ' ';
  text = ['"', text, '"'];
end

% Errors, with the place in the user's file.

function info = described(failure, host)
  switch (failure.identifier)
    case 'mbverify:unreachable'
      info.kind = 'unreachable';
    case {'mbverify:singular', 'Octave:singular-matrix', 'Octave:nearly-singular-matrix'}
      info.kind = 'singular';
    otherwise
      info.kind = 'exception';
  end
  info.message = failure.message;
  if (~isempty(strfind(failure.message, 'no conversion for assignment of ''object''')))
    info.message = ['a number that carries its derivatives does not go into an array of plain ' ...
                    'numbers: make the array by zeros(…), or at once by [a; b; c]'];
  end
  info.file = host.path;
  info.line = 0;
  info.function = '';
  t = regexp(failure.message, 'near line (\d+)(?:, column \d+)? of file (\S+)', 'tokens', 'once');
  if (~isempty(t))
    info.line = str2double(t{1});
    info.file = t{2};
    info.message = strtrim(regexprep(failure.message, '\s*\n\s*', '; '));
    return
  end
  for k = 1:numel(failure.stack)
    frame = failure.stack(k);
    if (~isempty(frame.file) && isempty(strfind(frame.file, '/share/octave/')) ...
        && ~any(cellfun(@(own) strncmp(frame.file, own, numel(own)), host.own)))
      info.file = frame.file;
      info.line = max(0, frame.line);
      if (isempty(strfind(frame.name, '<anonymous>')))
        info.function = regexprep(frame.name, '^.*>', '');
        return
      end
    end
  end
end

function path = canonical(path)
  path = make_absolute_filename(path);
end
