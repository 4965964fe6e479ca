function n = mbverify_level(x)
  % Of how many variables, one in another, x carries derivatives.
  n = 0;
  if (isa(x, 'mbverify_series'))
    n = x.level;
  end
end
