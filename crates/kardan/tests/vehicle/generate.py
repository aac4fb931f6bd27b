# pip install commonroad-vehicle-models==3.0.2 scipy; python3 generate.py
# Steering angle of the wheels: AMPLITUDE sin(pi t); forward speed 20 m/s; parameters of vehicle 2 (BMW 320i) and its tyres.
import math
import numpy as np
from scipy.integrate import solve_ivp
from vehiclemodels.parameters_vehicle2 import parameters_vehicle2
from vehiclemodels.utils.tire_model import formula_lateral
from vehiclemodels.vehicle_dynamics_st import vehicle_dynamics_st

p, speed, g = parameters_vehicle2(), 20.0, 9.81
times = np.linspace(0.0, 4.0, 41)


def solve(rate, start, name, columns, pick):
    found = solve_ivp(rate, (0.0, 4.0), start, method="DOP853", rtol=1e-13, atol=1e-14, t_eval=times, max_step=0.01)
    rows = np.column_stack([times] + [found.y[k] for k in pick])
    np.savetxt(name, rows, delimiter=",", header=columns, comments="", fmt="%.12g")


# Their linear single-track model as it stands: states x, y, delta, v, psi, psi', beta.
steer = 0.05
solve(lambda t, x: vehicle_dynamics_st(list(x), [steer * math.pi * math.cos(math.pi * t), 0.0], p),
      [0, 0, 0, speed, 0, 0, 0], "st.csv", "t,heading,yaw_rate,beta", [4, 5, 6])


# The equations of their drift model at a forward speed that is held, with their own function of the lateral tyre force and no force along the wheels.
def drift(t, x, steer=0.12):
    psi, r, v, px, py = x
    delta = steer * math.sin(math.pi * t)
    af, ar = math.atan((v + p.a * r) / speed) - delta, math.atan((v - p.b * r) / speed)
    load = [p.m * g * p.b / (p.a + p.b), p.m * g * p.a / (p.a + p.b)]
    f, b = [formula_lateral(a, 0, fz, p.tire)[0] for a, fz in zip([af, ar], load)]
    return [r, (p.a * f * math.cos(delta) - p.b * b) / p.I_z, (f * math.cos(delta) + b) / p.m - speed * r,
            speed * math.cos(psi) - v * math.sin(psi), speed * math.sin(psi) + v * math.cos(psi)]


solve(drift, [0, 0, 0, 0, 0], "magic.csv", "t,heading,yaw_rate,v_y,x,y", range(5))
