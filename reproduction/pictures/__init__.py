"""Pictures of the studies: charts, sheets of drawings and charts, joints, outlines."""
