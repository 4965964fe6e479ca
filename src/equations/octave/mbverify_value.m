function x = mbverify_value(x)
  % The numbers alone, without the derivatives that they carry.
  % (Those of a series are a method of it.)
end
