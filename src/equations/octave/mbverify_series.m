classdef mbverify_series
  % a + b t + c t^2: arrays that carry their first two derivatives by one variable. The coefficients
  % a, b, c have one size; they may be series of another variable (of a lower level). Where they are
  % numbers, b may have further pages: first derivatives by further variables.
  %
  % Operators and functions are those of numbers, element by element or of matrices. Comparisons are
  % those of the values; mbverify_value(x) gives the values. Real functions stay real: a root,
  % logarithm or arc of a number that has none ends the computation.
  properties
    a
    b
    c
    level
  end

  methods
    function s = mbverify_series(a, b, c, level)
      s.a = a;
      s.b = b;
      s.c = c;
      s.level = level;
    end

    % Sums and products.

    function s = plus(x, y)
      if (isobject(x))
        if (isobject(y))
          if (x.level == y.level)
            s = x;
            s.a = x.a + y.a;
            s.b = x.b + y.b;
            s.c = x.c + y.c;
            return
          elseif (x.level < y.level)
            s = shifted(y, x);
            return
          end
        end
        s = shifted(x, y);
      else
        s = shifted(y, x);
      end
    end

    function s = minus(x, y)
      if (isobject(x))
        if (isobject(y))
          if (x.level == y.level)
            s = x;
            s.a = x.a - y.a;
            s.b = x.b - y.b;
            s.c = x.c - y.c;
            return
          elseif (x.level < y.level)
            s = shifted(-y, x);
            return
          end
        end
        s = shifted(x, -y);
      else
        s = shifted(-y, x);
      end
    end

    function s = uminus(x)
      s = x;
      s.a = -x.a;
      s.b = -x.b;
      s.c = -x.c;
    end

    function s = uplus(x)
      s = x;
    end

    function s = times(x, y)
      if (isobject(x))
        if (isobject(y))
          if (x.level == y.level)
            s = x;
            xa = x.a;
            ya = y.a;
            xb = x.b;
            yb = y.b;
            s.a = xa .* ya;
            b = xa .* yb + xb .* ya;
            s.b = b;
            if (ndims(b) > 2)
              xb = xb(:, :, 1);
              yb = yb(:, :, 1);
            end
            s.c = xa .* y.c + xb .* yb + x.c .* ya;
            return
          elseif (x.level < y.level)
            s = y;
            s.a = x .* y.a;
            s.b = x .* y.b;
            s.c = x .* y.c;
            return
          end
        end
      else
        s = y;
        s.a = x .* y.a;
        s.b = x .* y.b;
        s.c = x .* y.c;
        return
      end
      s = x;
      s.a = x.a .* y;
      s.b = x.b .* y;
      s.c = x.c .* y;
    end

    function s = mtimes(x, y)
      if (isobject(x))
        xa = x.a;
        if (isobject(y))
          ya = y.a;
          if (numel(xa) == 1 || numel(ya) == 1)
            s = x .* y;
            return
          elseif (x.level == y.level)
            s = x;
            xb = x.b;
            yb = y.b;
            s.a = xa * ya;
            if (ndims(xb) == 2 && ndims(yb) == 2)
              s.b = xa * yb + xb * ya;
              s.c = xa * y.c + xb * yb + x.c * ya;
            else
              s.b = by_pages(xa, yb) + by_pages(xb, ya);
              s.c = xa * y.c + xb(:, :, 1) * yb(:, :, 1) + x.c * ya;
            end
            return
          elseif (x.level < y.level)
            s = y;
            s.a = x * ya;
            s.b = x * y.b;
            s.c = x * y.c;
            return
          end
        end
        b = x.b;
        s = x;
        s.a = xa * y;
        if (ndims(b) == 2)
          s.b = b * y;
        elseif (numel(xa) == 1 || numel(y) == 1)
          s.b = b .* y;
        else
          s.b = by_pages(b, y);
        end
        s.c = x.c * y;
      else
        ya = y.a;
        b = y.b;
        s = y;
        s.a = x * ya;
        if (ndims(b) == 2)
          s.b = x * b;
        elseif (numel(x) == 1 || numel(ya) == 1)
          s.b = x .* b;
        else
          s.b = by_pages(x, b);
        end
        s.c = x * y.c;
      end
    end

    function s = rdivide(x, y)
      if (~isobject(y))
        if (any(y(:) == 0))
          error('mbverify:singular', 'division by zero');
        end
        s = x;
        s.a = x.a ./ y;
        s.b = x.b ./ y;
        s.c = x.c ./ y;
      else
        s = x .* inverse(y);
      end
    end

    function s = ldivide(x, y)
      s = y ./ x;
    end

    function s = mrdivide(x, y)
      if (~isobject(y) && numel(y) == 1)
        if (y == 0)
          error('mbverify:singular', 'division by zero');
        end
        s = x;
        s.a = x.a ./ y;
        s.b = x.b ./ y;
        s.c = x.c ./ y;
      elseif (numel(y) == 1)
        s = x .* inverse(y);
      else
        s = (y.' \ x.').';
      end
    end

    function x = mldivide(A, r)
      % Order by order with the same matrix. What has no unique solution is solved by least squares.
      if (numel(A) == 1)
        x = r ./ A;
        return
      end
      if (size(A, 1) > size(A, 2))
        x = (A.' * A) \ (A.' * r);
        return
      elseif (size(A, 1) < size(A, 2))
        x = A.' * ((A * A.') \ r);
        return
      end
      [A, r] = aligned(A, r);
      x = r;
      x.a = A.a \ r.a;
      b = r.b - by_pages(A.b, x.a);
      x.b = reshape(A.a \ reshape(b, size(b, 1), []), size(b));
      x.c = A.a \ (r.c - first(A.b) * first(x.b) - A.c * x.a);
    end

    function s = power(x, n)
      if (isobject(n))
        s = exp(n .* log(x));
        return
      end
      if (numel(n) == 1)
        if (n == 2)
          s = x .* x;
          return
        elseif (n == round(n) && abs(n) <= 64)
          s = whole_power(x, n, @times);
          return
        elseif (n == 0.5)
          s = sqrt(x);
          return
        end
      end
      bad = n ~= round(n) & mbverify_value(x) < 0;
      if (any(bad(:)))
        error('mbverify:unreachable', 'a broken power of a negative number');
      end
      if (has_zero(x))
        error('mbverify:singular', 'a broken power of 0 has no derivative');
      end
      f = x.a .^ n;
      s = applied(x, f, n .* f ./ x.a, n .* (n - 1) .* f ./ (x.a .* x.a));
    end

    function s = mpower(x, n)
      if (numel(x) == 1)
        if (~isobject(n) && numel(n) == 1 && n == 2)
          s = x .* x;
        else
          s = x .^ n;
        end
      elseif (~isobject(n) && numel(n) == 1 && n == round(n))
        if (n < 0)
          s = whole_power(inv(x), -n, @mtimes);
        elseif (n == 0)
          s = constant(plain_eye(size(x, 1)), x.level);
        else
          s = whole_power(x, n, @mtimes);
        end
      else
        error('mbverify:series', 'a matrix to a power that is no whole number');
      end
    end

    % Functions.

    function s = sqrt(x)
      f = real_sqrt(x.a);
      if (~isobject(f) && all(f(:)))
        s = applied(x, f, 0.5 ./ f, -0.25 ./ (x.a .* f));
        return
      end
      nil = mbverify_value(f) == 0;
      if (any(nil(:)))
        if (isobject(x.a) || any(any(any(x.b .* nil))) || any(any(x.c .* nil)))
          error('mbverify:singular', 'the root of 0 has no derivative');
        end
        g = f;
        g(nil) = 1;  % a constant 0 stays one
        s = applied(x, f, 0.5 ./ g, -0.25 ./ g .^ 3);
      else
        s = applied(x, f, 0.5 ./ f, -0.25 ./ (x.a .* f));
      end
    end

    function s = realsqrt(x)
      s = sqrt(x);
    end

    function s = exp(x)
      f = exp(x.a);
      s = applied(x, f, f, f);
    end

    function s = log(x)
      r = 1 ./ x.a;
      s = applied(x, real_log(x.a), r, -r .* r);
    end

    function s = reallog(x)
      s = log(x);
    end

    function s = realpow(x, n)
      s = x .^ n;
    end

    function s = log10(x)
      s = log(x) ./ 2.302585092994045684;
    end

    function s = log2(x)
      s = log(x) ./ 0.693147180559945309;
    end

    function s = sin(x)
      f = sin(x.a);
      s = applied(x, f, cos(x.a), -f);
    end

    function s = cos(x)
      f = cos(x.a);
      s = applied(x, f, -sin(x.a), -f);
    end

    function s = tan(x)
      f = tan(x.a);
      g = 1 + f .* f;
      s = applied(x, f, g, 2 .* f .* g);
    end

    function s = sec(x)
      s = 1 ./ cos(x);
    end

    function s = csc(x)
      s = 1 ./ sin(x);
    end

    function s = cot(x)
      s = 1 ./ tan(x);
    end

    function s = sind(x)
      s = sin(deg2rad(x));
    end

    function s = cosd(x)
      s = cos(deg2rad(x));
    end

    function s = tand(x)
      s = tan(deg2rad(x));
    end

    function s = deg2rad(x)
      s = x .* (pi / 180);
    end

    function s = rad2deg(x)
      s = x .* (180 / pi);
    end

    function s = asin(x)
      [first, second] = arc_derivatives(x.a);
      s = applied(x, real_arc(@asin, x.a), first, second);
    end

    function s = acos(x)
      [first, second] = arc_derivatives(x.a);
      s = applied(x, real_arc(@acos, x.a), -first, -second);
    end

    function s = atan(x)
      g = 1 ./ (1 + x.a .* x.a);
      s = applied(x, atan(x.a), g, -2 .* x.a .* g .* g);
    end

    function s = sinh(x)
      f = sinh(x.a);
      s = applied(x, f, cosh(x.a), f);
    end

    function s = cosh(x)
      f = cosh(x.a);
      s = applied(x, f, sinh(x.a), f);
    end

    function s = tanh(x)
      f = tanh(x.a);
      g = 1 - f .* f;
      s = applied(x, f, g, -2 .* f .* g);
    end

    function s = asinh(x)
      s = log(x + sqrt(x .* x + 1));
    end

    function s = acosh(x)
      s = log(x + sqrt(x .* x - 1));
    end

    function s = atanh(x)
      s = 0.5 .* log((1 + x) ./ (1 - x));
    end

    function s = atan2(y, x)
      % With D = x^2 + y^2: angle' = (x y' - y x') / D.
      [y, x] = aligned(y, x);
      D = x.a .* x.a + y.a .* y.a;
      if (has_zero(D))
        error('mbverify:singular', 'atan2(0, 0) has no derivative');
      end
      s = x;
      s.a = atan2(y.a, x.a);
      s.b = (x.a .* y.b - y.a .* x.b) ./ D;
      s.c = (x.a .* y.c - y.a .* x.c - ...
             first(s.b) .* (x.a .* first(x.b) + y.a .* first(y.b))) ./ D;
    end

    function s = hypot(x, y)
      [x, y] = aligned(x, y);
      s = x;
      f = sqrt(x.a .* x.a + y.a .* y.a);
      if (has_zero(f))
        error('mbverify:singular', 'hypot(0, 0) has no derivative');
      end
      xb = x.b;
      yb = y.b;
      b = (x.a .* xb + y.a .* yb) ./ f;
      s.a = f;
      s.b = b;
      if (ndims(b) > 2)
        b = b(:, :, 1);
        xb = xb(:, :, 1);
        yb = yb(:, :, 1);
      end
      s.c = (x.a .* x.c + y.a .* y.c + 0.5 .* (xb .* xb + yb .* yb - b .* b)) ./ f;
    end

    function s = abs(x)
      v = mbverify_value(x);
      if (isreal(v))
        s = x .* (1 - 2 .* (v < 0));
      else
        s = hypot(real(x), imag(x));
      end
    end

    function s = real(x)
      s = each(x, @real);
    end

    function s = imag(x)
      s = each(x, @imag);
    end

    function s = conj(x)
      s = each(x, @conj);
    end

    function s = angle(x)
      s = atan2(imag(x), real(x));
    end

    function s = arg(x)
      s = angle(x);
    end

    function n = sign(x)
      n = sign(mbverify_value(x));
    end

    function n = floor(x)
      n = floor(mbverify_value(x));
    end

    function n = ceil(x)
      n = ceil(mbverify_value(x));
    end

    function n = round(x)
      n = round(mbverify_value(x));
    end

    function n = fix(x)
      n = fix(mbverify_value(x));
    end

    function s = mod(x, y)
      s = x - y .* floor(mbverify_value(x) ./ mbverify_value(y));
    end

    function s = rem(x, y)
      s = x - y .* fix(mbverify_value(x) ./ mbverify_value(y));
    end

    function [s, k] = max(x, y)
      if (nargin == 2)
        first = mbverify_value(x) >= mbverify_value(y);
        s = x .* first + y .* ~first;
      else
        [~, k] = max(reshape(mbverify_value(x), [], 1));
        s = part(x, k);
      end
    end

    function [s, k] = min(x, y)
      if (nargin == 2)
        first = mbverify_value(x) <= mbverify_value(y);
        s = x .* first + y .* ~first;
      else
        [~, k] = min(reshape(mbverify_value(x), [], 1));
        s = part(x, k);
      end
    end

    % Vectors and matrices.

    function s = sum(x, varargin)
      s = each(x, @sum, varargin{:});
    end

    function s = cumsum(x, varargin)
      s = each(x, @cumsum, varargin{:});
    end

    function s = mean(x, varargin)
      s = each(x, @mean, varargin{:});
    end

    function s = sumsq(x, varargin)
      s = sum(x .* x, varargin{:});
    end

    function s = prod(x)
      if (~isvector(x))
        error('mbverify:series', 'prod of a matrix that carries derivatives: use loops');
      end
      s = 1;
      for k = 1:numel(x)
        s = s .* part(x, k);
      end
    end

    function s = dot(x, y)
      if (isvector(x) && isvector(y))
        if (numel(x) ~= numel(y))
          error('mbverify:series', 'dot: sizes of x and y must match');
        end
        s = reshape(x, 1, []) * reshape(y, [], 1);
      else
        s = sum(x .* y);
      end
    end

    function s = cross(x, y)
      if (numel(x) ~= 3 || numel(y) ~= 3)
        error('mbverify:series', 'cross: vectors of three are wanted');
      end
      if (size(x, 1) ~= size(y, 1))
        y = y.';
      end
      if (isobject(x) && isobject(y) && x.level == y.level)
        s = x;
        s.a = cross3(x.a, y.a);
        s.b = cross3(x.a, y.b) + cross3(x.b, y.a);
        s.c = cross3(x.a, y.c) + cross3(first(x.b), first(y.b)) + cross3(x.c, y.a);
      elseif (is_above(x, y))
        s = x;
        s.a = cross3(x.a, y);
        s.b = cross3(x.b, y);
        s.c = cross3(x.c, y);
      else
        s = -cross(y, x);
      end
    end

    function s = norm(x, kind)
      if (nargin > 1 && ~isequal(kind, 2) && ~isequal(kind, 'fro'))
        error('mbverify:series', 'norm: of derivatives there is the Euclidean one alone');
      end
      if (~isvector(x) && ~(nargin > 1 && isequal(kind, 'fro')))
        error('mbverify:series', 'norm of a matrix that carries derivatives');
      end
      s = x;
      if (isobject(x.a))
        x = reshape(x, [], 1);
        s = sqrt(sum(x .* x));
        return
      end
      a = x.a(:);
      b = reshape(x.b, numel(a), []);
      s.a = a.' * a;
      s.b = reshape(2 .* (a.' * b), 1, 1, []);
      s.c = 2 .* (a.' * x.c(:)) + b(:, 1).' * b(:, 1);
      s = sqrt(s);
    end

    function s = inv(x)
      s = x \ plain_eye(size(x, 1));
    end

    function s = det(x)
      n = size(x, 1);
      if (n == 1)
        s = x;
      elseif (n == 2)
        s = part(x, 1) .* part(x, 4) - part(x, 3) .* part(x, 2);
      elseif (n == 3)
        s = dot(part(x, ':', 1), cross(part(x, ':', 2), part(x, ':', 3)));
      else
        % Along the first column.
        s = 0;
        for k = 1:n
          rows = [1:k - 1, k + 1:n];
          s = s + (-1) ^ (k + 1) .* part(x, k, 1) .* det(part(x, rows, 2:n));
        end
      end
    end

    function s = trace(x)
      s = sum(diag(x));
    end

    function s = transpose(x)
      s = x;
      s.a = x.a.';
      s.b = transposed(x.b);
      s.c = x.c.';
    end

    function s = ctranspose(x)
      s = x;
      s.a = x.a';
      s.b = conj(transposed(x.b));
      s.c = x.c';
    end

    function s = diag(x, varargin)
      s = each(x, @diag, varargin{:});
    end

    function s = reshape(x, varargin)
      s = x;
      s.a = reshape(x.a, varargin{:});
      if (ndims(x.b) > 2)
        s.b = reshape(x.b, size(s.a, 1), size(s.a, 2), []);
      else
        s.b = reshape(x.b, varargin{:});
      end
      s.c = reshape(x.c, varargin{:});
    end

    function s = repmat(x, varargin)
      s = each(x, @repmat, varargin{:});
    end

    function s = kron(x, y)
      [x, y] = aligned(x, y);
      [m, n] = size(x);
      [p, q] = size(y);
      x = part(x, ceil((1:m * p) / p), ceil((1:n * q) / q));
      s = x .* repmat(y, m, n);
    end

    function s = blkdiag(varargin)
      s = zeros(0, 0);
      for k = 1:nargin
        [m, n] = size(s);
        [p, q] = size(varargin{k});
        s = [s, plain_zeros([m, q]); plain_zeros([p, n]), varargin{k}];
      end
    end

    function s = horzcat(varargin)
      s = varargin{1};
      if (~isobject(s))
        s = series_of(varargin);
      end
      s = joined(s, @horzcat, varargin);
    end

    function s = vertcat(varargin)
      s = varargin{1};
      if (~isobject(s))
        s = series_of(varargin);
      end
      s = joined(s, @vertcat, varargin);
    end

    function s = cat(dim, varargin)
      if (dim == 1)
        s = vertcat(varargin{:});
      elseif (dim == 2)
        s = horzcat(varargin{:});
      else
        error('mbverify:series', 'cat: two dimensions at most');
      end
    end

    function v = mbverify_value(x)
      v = x.a;
      while (isobject(v))
        v = mbverify_value(v);
      end
    end

    % Comparisons are those of the values.

    function t = lt(x, y)
      t = mbverify_value(x) < mbverify_value(y);
    end

    function t = le(x, y)
      t = mbverify_value(x) <= mbverify_value(y);
    end

    function t = gt(x, y)
      t = mbverify_value(x) > mbverify_value(y);
    end

    function t = ge(x, y)
      t = mbverify_value(x) >= mbverify_value(y);
    end

    function t = eq(x, y)
      t = mbverify_value(x) == mbverify_value(y);
    end

    function t = ne(x, y)
      t = mbverify_value(x) ~= mbverify_value(y);
    end

    function t = logical(x)
      t = logical(mbverify_value(x));
    end

    function t = not(x)
      t = ~mbverify_value(x);
    end

    function t = any(x)
      t = any(mbverify_value(x));
    end

    function t = all(x)
      t = all(mbverify_value(x));
    end

    function t = isnan(x)
      t = isnan(mbverify_value(x));
    end

    function t = isinf(x)
      t = isinf(mbverify_value(x));
    end

    function t = isfinite(x)
      t = isfinite(mbverify_value(x));
    end

    function t = isreal(x)
      t = isreal(mbverify_value(x));
    end

    function t = iscomplex(x)
      t = ~isreal(mbverify_value(x));
    end

    function t = isnumeric(~)
      t = true;
    end

    function t = isfloat(~)
      t = true;
    end

    % Size and elements.

    function varargout = size(x, varargin)
      [varargout{1:max(1, nargout)}] = size(x.a, varargin{:});
    end

    function n = numel(x, varargin)
      if (nargin == 1)
        n = numel(x.a);
      else
        n = 1;  % of values of an indexing expression
      end
    end

    function n = length(x)
      n = length(mbverify_value(x));
    end

    function n = ndims(x)
      n = ndims(mbverify_value(x));
    end

    function n = rows(x)
      n = size(x.a, 1);
    end

    function n = columns(x)
      n = size(x.a, 2);
    end

    function t = isempty(x)
      t = isempty(mbverify_value(x));
    end

    function t = isscalar(x)
      t = numel(x.a) == 1;
    end

    function t = isvector(x)
      t = isvector(mbverify_value(x));
    end

    function t = isrow(x)
      t = size(x.a, 1) == 1;
    end

    function t = iscolumn(x)
      t = size(x.a, 2) == 1;
    end

    function t = ismatrix(~)
      t = true;
    end

    function t = issquare(x)
      t = size(x.a, 1) == size(x.a, 2);
    end

    function n = end(x, k, count)
      if (count == 1)
        n = numel(x.a);
      else
        n = size(x.a, k);
      end
    end

    function n = subsindex(x)
      n = mbverify_value(x) - 1;
    end

    function s = subsref(x, index)
      entry = index(1);
      if (entry.type(1) == '(')
        s = x;
        k = entry.subs;
        if (isobject(x.a))
          s.a = subsref(x.a, entry);
          s.b = subsref_of(x.b, entry);
          s.c = subsref_of(x.c, entry);
        else
          a = x.a(k{:});
          b = x.b;
          s.a = a;
          if (ndims(b) == 2)
            s.b = b(k{:});
          elseif (numel(k) == 2)
            s.b = b(k{:}, :);
          else
            b = reshape(b, [], size(b, 3));
            s.b = reshape(b(k{1}(:), :), size(a, 1), size(a, 2), []);
          end
          s.c = x.c(k{:});
        end
      elseif (strcmp(entry.type, '.') && any(strcmp(entry.subs, {'a', 'b', 'c', 'level'})))
        s = x.(entry.subs);
      else
        error('mbverify:series', 'a number has no fields and no cells');
      end
      if (numel(index) > 1)
        s = subsref(s, index(2:end));
      end
    end

    function x = subsasgn(x, index, y)
      if (numel(index) ~= 1 || ~strcmp(index.type, '()'))
        error('mbverify:series', 'a number has no fields and no cells');
      end
      if (~isobject(x))
        x = constant(x, y.level);
      elseif (isempty({x.level}))  % x was undefined
        x = constant([], y.level);
      elseif (isobject(y) && y.level > x.level)
        x = constant(x, y.level);
      end
      if (isobject(y) && y.level == x.level)
        x.a = subsasgn(x.a, index, y.a);
        x.b = paged_assign(x.b, index, y.b);
        x.c = subsasgn(x.c, index, y.c);
      elseif (isempty(y))
        k = index.subs;
        keep = reshape(1:numel(x), size(x));
        keep(k{:}) = [];
        x = part(x, keep);
      else
        x.a = subsasgn(x.a, index, y);
        x.b = paged_assign(x.b, index, 0);
        x.c = subsasgn(x.c, index, 0);
      end
    end

    function x = double(x)
      error('mbverify:series', ...
            ['a number that carries its derivatives would lose them here; ' ...
             'mbverify_value(x) gives the value alone']);
    end

    function disp(x)
      fprintf('with derivatives: ');
      disp(mbverify_value(x));
    end

    function display(x)
      disp(x);
    end

    % For the functions above.

    % x is a series, and y a number or of a lower level: a constant to it.
    function t = is_above(x, y)
      t = isobject(x) && (~isobject(y) || x.level > y.level);
    end

    function [x, y] = aligned(x, y)
      if (isobject(x) && isobject(y) && x.level == y.level)
        return
      elseif (is_above(x, y))
        y = constant(y, x.level);
      else
        x = constant(x, y.level);
      end
    end

    % x + k for a constant k.
    function s = shifted(x, k)
      s = x;
      s.a = x.a + k;
      if (numel(s.a) ~= numel(x.a))
        nought = plain_zeros(size(s.a));
        s.b = x.b + nought;
        s.c = x.c + nought;
      end
    end

    function s = inverse(y)
      a = y.a;
      if (has_zero(a))
        error('mbverify:singular', 'division by zero');
      end
      r = 1 ./ a;
      d = y.b .* r;
      s = y;
      s.a = r;
      s.b = -(d .* r);
      if (ndims(d) > 2)
        d = d(:, :, 1);
      end
      s.c = r .* (d .* d - y.c .* r);
    end

    % A function of x with its two derivatives at x.a.
    function s = applied(x, f, f1, f2)
      s = x;
      b = x.b;
      s.a = f;
      s.b = f1 .* b;
      if (ndims(b) > 2)
        b = b(:, :, 1);
      end
      s.c = f1 .* x.c + 0.5 .* f2 .* (b .* b);
    end

    % What is linear, of each coefficient.
    function s = each(x, f, varargin)
      s = x;
      s.a = f(x.a, varargin{:});
      b = x.b;
      if (ndims(b) == 2)
        s.b = f(b, varargin{:});
      else
        pages = cell(1, size(b, 3));
        for k = 1:numel(pages)
          pages{k} = f(b(:, :, k), varargin{:});
        end
        s.b = cat(3, pages{:});
      end
      s.c = f(x.c, varargin{:});
    end

    function s = joined(s, how, parts)
      level = s.level;
      a = parts;
      b = parts;
      c = parts;
      pages = 1;
      for k = 1:numel(parts)
        x = parts{k};
        if (isobject(x))
          if (x.level == level)
            a{k} = x.a;
            bk = x.b;
            b{k} = bk;
            c{k} = x.c;
            if (ndims(bk) > 2)
              pages = size(bk, 3);
            end
            continue
          elseif (x.level > level)
            s = joined(x, how, parts);
            return
          end
        end
        b{k} = builtin('zeros', size(x));
        c{k} = b{k};
      end
      if (pages > 1)
        for k = 1:numel(parts)
          if (ndims(b{k}) == 2)
            b{k} = b{k}(:, :, builtin('ones', 1, pages));
          end
        end
      end
      s.a = how(a{:});
      s.b = how(b{:});
      s.c = how(c{:});
    end
  end
end

function s = constant(x, level)
  nought = plain_zeros(size(x));
  s = mbverify_series(x, nought, nought, level);
end

function s = part(x, varargin)
  s = subsref(x, struct('type', '()', 'subs', {varargin}));
end

function s = subsref_of(x, index)
  k = index.subs;
  if (isobject(x))
    s = subsref(x, index);
  else
    s = x(k{:});
  end
end

function s = whole_power(x, n, product)
  if (n == 2)
    s = product(x, x);
    return
  end
  if (n < 0)
    s = inverse(whole_power(x, -n, product));
    return
  end
  if (n == 0)
    s = 0 .* x + 1;
    return
  end
  bits = dec2bin(n);
  s = x;
  for bit = bits(2:end)
    s = product(s, s);
    if (bit == '1')
      s = product(s, x);
    end
  end
end

function f = real_sqrt(x)
  if (isobject(x))
    f = sqrt(x);
  else
    demand_real('sqrt', x, x < 0);
    f = builtin('sqrt', x);
  end
end

function f = real_log(x)
  if (isobject(x))
    f = log(x);
  else
    demand_real('log', x, x <= 0);
    f = builtin('log', x);
  end
end

function f = real_arc(arc, x)
  if (isobject(x))
    f = arc(x);
  else
    f = builtin(func2str(arc), x);
  end
end

function [first, second] = arc_derivatives(x)
  v = mbverify_value(x);
  demand_real('the arc', v, abs(v) > 1);
  s = 1 - x .* x;
  if (has_zero(s))
    error('mbverify:singular', 'the arc of 1 has no derivative');
  end
  first = 1 ./ real_sqrt(s);
  second = first .* x ./ s;
end

function demand_real(name, x, bad)
  if (any(bad(:)) && isreal(x))
    x = x(bad);
    error('mbverify:unreachable', '%s of %g', name, x(1));
  end
end

function s = cross3(x, y)
  if (size(x, 1) == 3)
    s = x([2 3 1], :, :) .* y([3 1 2], :, :) - x([3 1 2], :, :) .* y([2 3 1], :, :);
  else
    s = x(:, [2 3 1], :) .* y(:, [3 1 2], :) - x(:, [3 1 2], :) .* y(:, [2 3 1], :);
  end
end

% Inside of derivatives zeros(…) and eye(…) are series; these are not.
function x = plain_zeros(sizes)
  x = builtin('zeros', sizes);
end

function x = plain_eye(n)
  x = builtin('eye', n) + 0;
end

function s = series_of(parts)
  for k = 1:numel(parts)
    s = parts{k};
    if (isa(s, 'mbverify_series'))
      return
    end
  end
end

function t = has_zero(x)
  v = mbverify_value(x);
  t = any(v(:) == 0);
end

% The derivatives by the first variable.
function b = first(b)
  if (ndims(b) > 2)
    b = b(:, :, 1);
  end
end

function s = by_pages(x, y)
  m = size(x, 3);
  n = size(y, 3);
  if (m == 1 && n == 1)
    s = x * y;
  elseif (m == 1)
    s = reshape(x * reshape(y, size(y, 1), []), size(x, 1), [], n);
  else
    s = builtin('zeros', size(x, 1), size(y, 2), m);
    for k = 1:m
      s(:, :, k) = x(:, :, k) * y;
    end
  end
end

function s = transposed(x)
  if (ndims(x) > 2)
    s = permute(x, [2 1 3]);
  else
    s = x.';
  end
end

function x = paged_assign(x, index, y)
  m = size(x, 3);
  n = size(y, 3);
  if (m == 1 && n == 1)
    x = subsasgn(x, index, y);
    return
  end
  pages = cell(1, max(m, n));
  for k = 1:numel(pages)
    pages{k} = subsasgn(x(:, :, min(k, m)), index, y(:, :, min(k, n)));
  end
  x = cat(3, pages{:});
end
