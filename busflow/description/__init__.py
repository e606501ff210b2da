"""Description: a robot's links and joints as its URDF file says them, and the node that publishes where they are.

Runs no xacro, and draws nothing. What is known of the file is known before the start, with every mistake at its place.

- `xml_file`: a bounded XML file with the place of each element and attribute; it refuses what would read further files.
- `packages`: the files that addresses such as `package://my_robot/meshes/arm.stl` mean, inside of the named folders.
- `robot`: links, joints, and the motion of a joint at a position. Pure.
- `reading`: a file while it is read, with its numbers and problems.
- `parts`: the elements and attributes of a URDF file, each in its place.
- `urdf`: the robot that a file describes, checked.
- `link_frame`: the transform of a link at a position of its joint.
- `robot_state_publisher`: the node, installed as the plugin of this name.
"""
