"""Position-controlled joints: the law of a servo, and its parameters from commands and positions alone.

A servo closes its loop inside the joint, with q_s the commanded position after a delay and a rate limit:

    duty = clip(g kp (q_s - q), +-limit)     torque = a V duty - b qd     a = kt/R,  b = kt^2/R

kt = ke is the torque constant as seen behind the gear, R the resistance, V the supply, g the duty per unit of firmware gain kp
and rad. Friction and the rotor's inertia Ia act as at any joint.
"""

from idbench.identify.servo.fit import ServoFit as ServoFit
from idbench.identify.servo.identification import identify_again as identify_again
from idbench.identify.servo.identification import identify_servo as identify_servo
from idbench.identify.servo.law import Servo as Servo
from idbench.identify.servo.parameters import SERVO_FRICTIONS as SERVO_FRICTIONS
from idbench.identify.servo.parameters import parameters_of as parameters_of
from idbench.identify.servo.run import JointLoad as JointLoad
from idbench.identify.servo.run import ServoRun as ServoRun
