function [z, x] = alpha_of(profile, beta_deg, gamma_deg)
% ALPHA_OF  alpha_z and alpha_x in N/cm^3 of profile = jsondecode(fileread('profile.json'))
%   The angles in degrees are arrays of one shape. Runs in MATLAB and in Octave 7 or newer.
  nodes = profile.nodes;
  rows = nodes.beta_deg(:);
  columns = nodes.gamma_deg(:)';
  beta = mod(beta_deg + 90, 180) - 90;
  gamma = mod(gamma_deg + 180, 360) - 180;
  z = interp2(columns, rows, nodes.alpha_z_N_per_cm3, gamma, beta, 'linear');
  x = interp2(columns, rows, nodes.alpha_x_N_per_cm3, gamma, beta, 'linear');
end
