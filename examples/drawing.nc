(a slot with round ends, in mm and mm/min, in the room of planar-3)
G21 G90 G17
F24000
G0 X-150 Y1500
G1 X150
G3 X150 Y1700 R100
G1 X-150
G3 X-150 Y1500 R100
M2
