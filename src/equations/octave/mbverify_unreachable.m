function mbverify_unreachable(why)
  % Ends the computation: the equations have no pose there, and why.
  error('mbverify:unreachable', '%s', why);
end
