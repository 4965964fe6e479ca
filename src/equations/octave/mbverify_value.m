function x = mbverify_value(x)
  % The numbers alone, without the derivatives that they carry.
  while (isa(x, 'mbverify_series'))
    x = x.a;
  end
end
