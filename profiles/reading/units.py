"""The one place for conversions from the units of name plates and data sheets to SI."""

import math

RAD_S_PER_RPM = 2.0 * math.pi / 60.0
N_PER_KGF = 9.80665
kg_m2_PER_lb_in_s2 = 0.45359237 * N_PER_KGF * 0.0254
