function [z, x] = alpha_of(profile, beta_deg, gamma_deg)
% ALPHA_OF  alpha_z and alpha_x in N/cm^3 of profile = jsondecode(fileread('profile.json'))
%   The angles in degrees are arrays of one shape. Runs in MATLAB and in Octave 7 or newer.
  of = profile.directions;
  % mirror images; the grid begins at (-90, -180) and its last lines are the first ones
  beta = round(1e6 * ([of.beta_deg(:); -of.beta_deg(:)] + 90)) / 1e6;
  gamma = round(1e6 * ([of.gamma_deg(:); 180 - of.gamma_deg(:)] + 180)) / 1e6;
  [rows, ~, i] = unique(mod(beta, 180));
  [columns, ~, j] = unique(mod(gamma, 360));
  place = [i(:), j(:)];
  shape = [numel(rows), numel(columns)];
  tables = {accumarray(place, [of.alpha_z_N_per_cm3(:); of.alpha_z_N_per_cm3(:)], shape, @(v) v(1)), ...
            accumarray(place, [of.alpha_x_N_per_cm3(:); -of.alpha_x_N_per_cm3(:)], shape, @(v) v(1))};
  at = {mod(gamma_deg + 180, 360), mod(beta_deg + 90, 180)};
  found = cell(1, 2);
  for k = 1:2
    closed = tables{k}([1:end, 1], [1:end, 1]);
    found{k} = interp2([columns(:); 360]', [rows(:); 180], closed, at{:}, 'linear');
  end
  [z, x] = found{:};
end
